"""The exceptions of fingerslip: each says where, what was found, what is allowed and how to repair it."""

from __future__ import annotations

import contextlib
import difflib
import importlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

_LONGEST = 80


def shorten(text: str) -> str:
    """Return text as errors show it: on one line, of at most 80 characters."""
    line = " ".join(text.split())
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}..."


class FingerslipError(Exception):
    """Base of all errors that fingerslip raises on purpose; for how to catch one see :class:`InputError`."""


class InputError(FingerslipError, ValueError):
    """An input that cannot be used, with its four parts.

    Parameters
    ----------
    where : str
        The location, such as ``studies/x.yaml: contact.friction_coefficient``.
    found : str
        What stands there, such as ``got -0.2``.
    allowed : str
        What may stand there, such as ``needs a number >= 0``.
    repair : str, optional
        What to write instead, where `allowed` does not say it already.
    line : int, optional
        Line of the file, counted from 1, where it is known.

    Examples
    --------
    >>> import fingerslip as fs
    >>> try:
    ...     fs.Press(depth="1", speed=5e-3)
    ... except fs.InputError as error:
    ...     print(error.where, error.found, error.allowed, error.repair, sep=" | ")
    Press.depth | '1' has no unit | needs a unit of [m] | write '1 mm' or '1 m'
    """

    def __init__(self, where: str, found: str, allowed: str, repair: str = "", line: int | None = None) -> None:
        self.where, self.found, self.allowed, self.repair, self.line = where, found, allowed, repair, line
        super().__init__(where, found, allowed, repair, line)

    @property
    def all(self) -> tuple[InputError, ...]:
        """Every mistake, each an error of its own; of a single mistake the error itself."""
        return (self,)

    def moved(self, position: Callable[[str], str], line: int | None = None) -> InputError:
        """Return the error, of the same kind, where `position` puts it, with its own line of the file or another."""
        return type(self)(position(self.where), self.found, self.allowed, self.repair, line or self.line)

    def __str__(self) -> str:
        text = f"{self.where}: {self.found}, {self.allowed}" if self.where else f"{self.found}, {self.allowed}"
        text = f"{text}; {self.repair}" if self.repair else text
        return text if self.line is None else f"{text} (line {self.line})"


def optional_module(module: str, extra: str, where: str, needs: str) -> Any:
    """Return a module of an optional dependency, or say what needs it and which extra installs it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        repair = f'pip install "fingerslip[{extra}]"'
        raise InputError(where, f"{module} is missing ({error})", needs, repair) from error


@contextlib.contextmanager
def errors_at(where: str) -> Iterator[None]:
    """Put what is refused in the block at a place, whose name comes before the locations inside it."""
    try:
        yield
    except InputError as error:
        raise error.moved(lambda inside: f"{where}: {inside}" if inside else where) from None


def unknown_name(where: str, name: str, names: Iterable[str]) -> InputError:
    """Return the error of a name that is not among those that are known, with the most similar one as its repair."""
    known_names = list(names)
    return InputError(
        where, f"'{name}' is not known", f"needs one of {', '.join(known_names)}", did_you_mean(name, known_names)
    )


def most_similar(name: str, names: Iterable[str], count: int = 6) -> list[str]:
    """Return so many names at most, those that are most like one first.

    Examples
    --------
    >>> most_similar("slied.yaml", ["a.yaml", "block.yaml", "slide.yaml"], 1)
    ['slide.yaml']
    """
    likeness = {known: difflib.SequenceMatcher(None, known.casefold(), name.casefold()).ratio() for known in names}
    return sorted(likeness, key=lambda known: (-likeness[known], known))[:count]


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return the question after the most similar of some names, whatever their case; empty where none is similar.

    Where several begin with all of the name, the question is after each.
    """
    by_lower = {known.casefold(): known for known in names}
    longer = [known for lower, known in by_lower.items() if name and lower.startswith(name.casefold())]
    if len(longer) > 1:
        names_of_all = "' or '".join(sorted(longer))
        return f"did you mean '{names_of_all}'?"
    near = difflib.get_close_matches(name.casefold(), by_lower, n=1)
    return f"did you mean '{by_lower[near[0]]}'?" if near else ""


class InputErrors(InputError):  # noqa: N818  it holds several
    """Several mistakes in one input; the four parts are those of the first."""

    def __init__(self, mistakes: Sequence[InputError]) -> None:
        self._all = tuple(mistakes)
        first = self._all[0]
        super().__init__(first.where, first.found, first.allowed, first.repair, first.line)
        self.args = (self._all,)

    @property
    def all(self) -> tuple[InputError, ...]:
        """Every mistake, each an error of its own."""
        return self._all

    def moved(self, position: Callable[[str], str], line: int | None = None) -> InputError:
        """Return the mistakes at other locations; see :meth:`InputError.moved`."""
        return InputErrors([error.moved(position, line) for error in self._all])

    def __str__(self) -> str:
        return "\n".join(str(error) for error in self._all)


class Mistakes:
    """Mistakes of several checks that are raised together, one that was found twice once."""

    def __init__(self, result: Iterable[InputError] = ()) -> None:
        self.found = list(result)

    @contextlib.contextmanager
    def collect(self) -> Iterator[None]:
        """Keep the mistakes that are raised in the block, and go on behind it."""
        try:
            yield
        except InputError as error:
            self.found.extend(error.all)

    def error(self) -> InputError:
        """Return what was found as one error: the only mistake itself, :class:`InputErrors` of several."""
        different = tuple({str(mistake): mistake for mistake in self.found}.values())
        return different[0] if len(different) == 1 else InputErrors(different)

    def raise_all(self) -> None:
        """Raise what was found, if anything was; see :meth:`error`."""
        if self.found:
            raise self.error()


class MeshError(InputError):
    """A mesh that cannot be built, read or used in a computation."""


class SlipOutsideContactError(InputError):
    """Contact reached a node of the boundary that is no contact candidate."""


class ConvergenceError(FingerslipError):
    """A time step was not solved: its frictional contact, or at large strain its equation of motion.

    Parameters
    ----------
    time : float
        Time of the step [s].
    node : int
        Mesh node with the largest residual.
    residual : float
        Relative residual reached [-].
    tolerance : float
        Largest relative residual allowed [-].
    advice : str
        What to try.
    problem : str, optional
        What was not solved.
    position : tuple of float, optional
        Where the node is at rest [m].

    Attributes
    ----------
    history : xarray.Dataset, optional
        What was computed of a single model before, whose attribute ``failure`` says this error.
    """

    history: Any = None

    def __init__(  # noqa: PLR0917
        self,
        time: float,
        node: int,
        residual: float,
        tolerance: float,
        advice: str,
        problem: str = "contact",
        position: tuple[float, ...] = (),
    ) -> None:
        self.time, self.node, self.residual, self.position = time, node, residual, position
        self.tolerance, self.advice, self.problem = tolerance, advice, problem
        super().__init__(time, node, residual, tolerance, advice, problem, position)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.args  # no history goes from process to process

    def __str__(self) -> str:
        place = f" at ({', '.join(f'{1e3 * value:.4g}' for value in self.position)}) mm" if self.position else ""
        return (
            f"{self.problem} at t = {self.time:.6g} s, node {self.node}{place}: residual {self.residual:.2e}, "
            f"needs <= {self.tolerance:.0e}; {self.advice}"
        )


class EquilibriumError(ConvergenceError):
    """A body without inertia finds no equilibrium: contact, which alone holds it, does not carry its loads.

    Parameters
    ----------
    time : float
        Time of the step [s].
    bodies : tuple of str, optional
        What only contact holds, one of which it does not; the body without it.
    """

    def __init__(self, time: float, bodies: tuple[str, ...] = ()) -> None:
        super().__init__(time, -1, float("inf"), 0.0, "support it, let it touch more, or take TimeStepping")
        self.bodies = bodies
        self.args = (time, bodies)

    def __str__(self) -> str:
        held = " or the ".join(self.bodies or ("body",))
        return f"equilibrium at t = {self.time:.6g} s: contact alone does not hold the {held}; {self.advice}"


class InvertedCellError(FingerslipError):
    """A cell is turned inside out by a displacement.

    Parameters
    ----------
    cell : int
        The cell.
    position : tuple of float
        Its middle in the reference state [m].
    """

    def __init__(self, cell: int, position: tuple[float, ...]) -> None:
        self.cell, self.position = cell, position
        super().__init__(cell, position)

    def __str__(self) -> str:
        coordinates = ", ".join(f"{1e3 * value:.6g}" for value in self.position)
        return f"cell {self.cell} at ({coordinates}) mm is turned inside out"


class ResultError(FingerslipError):
    """A result that cannot be written or read back."""


class DamagedError(ResultError):
    """A file of a result that is not as it was written."""

    def __init__(self, file: str, found: str, repair: str) -> None:
        self.file, self.found, self.repair = file, found, repair
        super().__init__(file, found, repair)

    def __str__(self) -> str:
        return f"{self.file}: {self.found}; {self.repair}"


class TruncatedVideoError(FingerslipError):
    """A video of which fewer frames could be read than it says to have."""

    def __init__(self, file: str, result: int, said: int) -> None:
        self.file, self.found, self.said = file, result, said
        super().__init__(file, result, said)

    def __str__(self) -> str:
        return f"{self.file}: ends after {self.found} of {self.said} frames; copy or record it again"
