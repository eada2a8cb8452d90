"""Variants of a profile: the text of a TOML file with other values."""
import re


def changed(text, values, where):
    """`values`: key -> TOML text of its value. A key must be there exactly once: a silent default would measure something else."""
    for key, value in values.items():
        text, n = re.subn(rf"^{key} = [^\s#]+", f"{key} = {value}", text, flags=re.M)
        if n != 1:
            raise SystemExit(f"{where} has {n} lines for {key}, expected one")
    return text
