"""Pictures of an evaluation."""


def draw(groups, out):
    return []
