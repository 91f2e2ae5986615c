"""``fingerslip react``: does a detector's alarm save the object?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo

from fingerslip.commands.shared import AsJson, print_tables


def react(
    results: Annotated[Path, Argument(metavar="RESULTS", help="Results of a study with the block reaction.")],
    onsets: Annotated[
        Path | None,
        Argument(metavar="[CSV]", help="Onset times from the start of each run: trial, incipient_s, gross_s."),
    ] = None,
    *,
    trials: Annotated[
        Path | None, Option(metavar="DIR", help="Write the runs as a data set for detectors instead.")
    ] = None,
    frame_rate: Annotated[float, Option(min=1.0, help="Frames a second of the data set.")] = 250.0,
    lost: Annotated[bool, Option("--lost", help="Only objects that are lost: trials to learn from.")] = False,
    as_json: AsJson = False,
) -> None:
    """Score the alarms of a detector on held objects: how many are saved, with what force, how many grips are false.

    Any detector takes part: it sees the data set that --trials writes, and its onset times are scored.
    """
    from fingerslip.errors import InputError
    from fingerslip.study.trials.holding import held_runs, held_trials, score_alarms

    held_runs(results)  # where there are none, that is what is wrong first
    if (onsets is None) == (trials is None):
        fault = "has onset times and --trials" if onsets else "has no onset times and no --trials"
        repair = "write --trials DIR, or a CSV file; of how long there is to react, 'fingerslip run' tells"
        raise InputError("react", fault, "needs one of them", repair)
    if trials is not None:
        echo(f"{trials}: {len(held_trials(results, trials, frame_rate, lost=lost).names)} trials")
    elif onsets is not None:
        print_tables([score_alarms(results, onsets)], as_json)
