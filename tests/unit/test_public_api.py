"""The public names, signatures and defaults are those of the snapshot beside this file.

Where one changes on purpose, make the snapshot again: python -m unit.test_public_api (in `tests`), and say it in the
changelog.
"""

import inspect
from pathlib import Path

import fingerslip as fs

SNAPSHOT = Path(__file__).with_name("public_api.txt")


def described(name):
    """Return a public name with its parameters and their defaults; types stand in `__init__.pyi`."""
    thing = getattr(fs, name)
    if not callable(thing) or (inspect.isclass(thing) and issubclass(thing, BaseException)):
        return name
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return name
    shown = [str(parameter.replace(annotation=inspect.Parameter.empty)) for parameter in parameters]
    return f"{name}({', '.join(shown)})"


def snapshot():
    return "".join(f"{described(name)}\n" for name in sorted(fs.__all__) if name != "__version__")


def test_the_public_face_is_that_of_the_snapshot():
    assert snapshot() == SNAPSHOT.read_text(encoding="utf-8")


if __name__ == "__main__":
    SNAPSHOT.write_text(snapshot(), encoding="utf-8")
