"""A name says what the thing is; a function is a verb or a noun."""

import ast
import functools
import re

from places import ROOT, parsed

VAGUE = {"found", "own", "one", "known", "parts", "place", "kept", "shown", "given", "taken", "told", "made", "there"}
# 2D and 3D have these names; planes and spaces of another kind are those of something.
SPACE = re.compile(r"\bin the plane\b(?! (of|through)\b)|\bin space\b(?!\.)")
PARTICIPLE = re.compile(r"_?(\w+ed|made|kept|shown|known|held|told|taken|found|given)")


@functools.cache
def functions():
    return [
        (f"{path.name}:{node.lineno} {node.name}", node)
        for path in sorted((ROOT / "src" / "fingerslip").rglob("*.py"))
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.FunctionDef)
    ]


def variables(function):
    stored = {node.id for node in ast.walk(function) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return stored | {argument.arg for argument in (*function.args.args, *function.args.kwonlyargs)}


def test_few_things_and_functions_have_a_name_that_says_nothing():
    vague = [where for where, function in functions() if variables(function) & VAGUE]
    assert len(vague) < 100, vague
    participles = [where for where, function in functions() if PARTICIPLE.fullmatch(function.name)]
    assert len(participles) < 60, participles


def test_2d_and_3d_are_called_so():
    files = [path for path in (ROOT / "src" / "fingerslip").rglob("*") if path.suffix in {".py", ".yaml"}]
    files += [path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts]
    texts = {path: " ".join(path.read_text(encoding="utf-8").split()) for path in files}
    assert [str(path) for path, text in texts.items() if SPACE.search(text)] == []
