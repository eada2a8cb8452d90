"""JSON Schema of the message types in lcmtypes/*.lcm, their comments included, and messages of the generated Python types as JSON values."""
import base64
import os
import re

INTEGERS = {"int8_t", "int16_t", "int32_t", "int64_t"}
FIELD = re.compile(r"^\s*(\w+)\s+(\w+)((?:\[\w+\])*)\s*;\s*(?://\s*(.*))?$")


def fields(path):
    """[(type, name, [dimension], comment)] of the one struct in this file; a dimension is a number or the name of a field."""
    out = []
    inside = False
    with open(path) as file:
        for line in file:
            if line.startswith("struct"):
                inside = True
            elif line.startswith("}"):
                inside = False
            elif inside and not line.lstrip().startswith(("const", "//")) and (m := FIELD.match(line)):
                kind, name, dimensions, comment = m.groups()
                out.append((kind, name, re.findall(r"\[(\w+)\]", dimensions), comment or ""))
            elif inside and out and (m := re.match(r"^\s*//\s*(.*)$", line)):
                out[-1] = (*out[-1][:3], f"{out[-1][3]} {m[1]}".strip())
    return out


def schema(folder, name):
    """Of type NAME, whose file is FOLDER/NAME.lcm. Byte arrays are base64; all else as its words say."""
    properties = {}
    for kind, field, dimensions, comment in fields(os.path.join(folder, name + ".lcm")):
        if kind == "byte" and dimensions:
            one = {"type": "string", "contentEncoding": "base64"}
        else:
            one = scalar(folder, kind)
            for d in reversed(dimensions):
                one = {"type": "array", "items": one}
                if d.isdigit():
                    one["minItems"] = one["maxItems"] = int(d)
        if comment:
            one["description"] = comment
        properties[field] = one
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"cyclops.{name}", "type": "object", "properties": properties,
            "required": list(properties)}


def scalar(folder, kind):
    if kind in INTEGERS or kind == "byte":
        return {"type": "integer"}
    if kind in ("float", "double"):
        return {"type": ["number", "null"]}  # null: not a number, or infinite
    if kind == "boolean":
        return {"type": "boolean"}
    if kind == "string":
        return {"type": "string"}
    inner = schema(folder, kind)
    del inner["$schema"]
    return inner


class Values:
    """Messages as values for json.dumps, by the fields of their types."""

    def __init__(self, folder):
        self.folder = folder
        self.known = {}

    def of(self, name, message):
        if name not in self.known:
            self.known[name] = fields(os.path.join(self.folder, name + ".lcm"))
        return {field: self.value(kind, len(dimensions), getattr(message, field)) for kind, field, dimensions, _ in self.known[name]}

    def value(self, kind, depth, v):
        if kind == "byte" and depth:
            return base64.b64encode(bytes(v)).decode()
        if depth:
            return [self.value(kind, depth - 1, x) for x in v]
        if kind in ("float", "double"):
            return v if abs(v) < float("inf") else None  # false for nan as well
        if kind == "boolean":
            return bool(v)
        return v if kind in INTEGERS or kind in ("string", "byte") else self.of(kind, v)
