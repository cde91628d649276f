"""Runs a tool over a folder of recordings, in one process each, on all cores or a Dask cluster.

Each output is written into a hidden folder next to its destination and moved when it is complete.
So there are no partial results, nothing is computed twice, and an interrupted run can be continued.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from pose_core.errors import InputError, PoseError, one_line
from pose_node.command_line import jobs
from pose_node.plain_console import plain_console

BAG_FILES = (".mcap", ".db3")
TEXT_FILES = (".csv", ".csv.gz")  # recordings of skeletons
SHOWN = 40  # rows of the summary; beyond, only failures and the totals
INSTALL_DASK = "pip install 'dask[distributed]'"


@dataclass(frozen=True, kw_only=True)
class Job:
    """One recording; ``command`` has :data:`OUTPUT` where the output's name belongs."""

    recording: str
    output: str
    command: tuple[str, ...]
    run: str  # the run's own name, in what it leaves half made


@dataclass(frozen=True, kw_only=True)
class JobResult:
    """Result of a job."""

    job: Job
    state: str  # done, there already, failed
    message: str = ""  # what the tool has printed; of a failure, the error
    duration_s: float = 0.0  # [s]


OUTPUT = "{output}"


def add_many_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of a run over many recordings."""
    group = parser.add_argument_group("a folder of recordings")
    group.add_argument(
        "--jobs", type=jobs, default=os.cpu_count() or 1, metavar="N", help="at once (all cores)"
    )
    group.add_argument(
        "--dask", metavar="ADDRESS", help="of a Dask scheduler whose workers see the same files"
    )


def recordings_under(folder: Path) -> list[Path]:
    """All bags below a folder, sorted by name; empty if the folder is itself a bag.

    A folder without bags may hold recordings of skeletons in text files.
    """
    if not folder.is_dir() or _is_bag(folder):
        return []
    below = sorted(path for path in folder.rglob("*") if not path.name.startswith("."))
    bags = [path for path in below if _is_bag(path) and not _is_bag(path.parent)]
    return bags or [path for path in below if path.name.endswith(TEXT_FILES)]


def without_suffix(path: Path) -> Path:
    """The path without the suffix of a recording's file; any other dot is part of the name."""
    for suffix in (*BAG_FILES, *TEXT_FILES):
        if path.name.endswith(suffix):
            return path.with_name(path.name.removesuffix(suffix))
    return path


def _is_bag(path: Path) -> bool:
    if path.name.startswith("."):
        return False
    if path.is_dir():
        first = (path / f"{path.name}{part}{suffix}" for part in ("", "_0") for suffix in BAG_FILES)
        return (path / "metadata.yaml").exists() or any(file.exists() for file in first)
    return path.suffix in BAG_FILES


def run_many(
    source: Path, target: Path | None, arguments: argparse.Namespace, suffix: str = ""
) -> int | None:
    """Run this very tool on each recording below a folder.

    Args:
        source: The folder or recording that was given, as it stands in the arguments.
        target: The folder of the outputs, as it stands in the arguments.
        arguments: Parsed, with those of :func:`add_many_arguments`.
        suffix: Of each output's name, which is the recording's otherwise.

    Returns:
        The exit status; None if the source is one recording.

    Raises:
        InputError: If the source is a folder of recordings, and there is no target.
    """
    recordings = recordings_under(source)
    if not recordings:
        return None
    if target is None:
        raise InputError(f"{source} is a folder of recordings: name one for the outputs by -o")
    run = uuid.uuid4().hex[:8]
    jobs = [
        Job(
            run=run,
            recording=str(recording),
            output=f"{target.absolute() / without_suffix(recording.relative_to(source))}{suffix}",
            command=tuple(_command(sys.argv, source, target, recording.absolute())),
        )
        for recording in recordings
    ]
    outcomes = []
    title = f"{len(jobs)} recording{'s' if len(jobs) > 1 else ''}"
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task(title, total=len(jobs))
        for outcome in run_jobs(jobs, arguments.jobs, arguments.dask):
            outcomes.append(outcome)
            failed = sum(each.state == "failed" for each in outcomes)
            shown = f"{title}, {failed} failed" if failed else title
            progress.update(task, advance=1, description=shown)
    remove_leftovers(jobs)
    plain_console().print(summary(outcomes))
    return int(any(outcome.state == "failed" for outcome in outcomes))


def run_jobs(jobs: Sequence[Job], workers: int, dask: str | None = None) -> Iterator[JobResult]:
    """Run jobs in parallel; yield the outcomes as they end.

    Raises:
        PoseError: If Dask is wanted and is not installed, or no scheduler answers.
    """
    with ThreadPoolExecutor(max(workers, 1)) if dask is None else _dask_executor(dask) as pool:
        futures = {pool.submit(run_job, job): job for job in jobs}
        for future in as_completed(futures):
            error = future.exception()
            if error is None:
                yield future.result()
            else:
                yield JobResult(job=futures[future], state="failed", message=one_line(error))


def run_job(job: Job) -> JobResult:
    """Run one job in a separate process."""
    output, begin = Path(job.output), time.monotonic()
    if output.exists():
        return JobResult(job=job, state="there already")
    folder = output.parent / f".part-{job.run}-{uuid.uuid4().hex[:8]}"
    folder.mkdir(parents=True)
    part = folder / output.name
    command = [str(part) if word == OUTPUT else word for word in job.command]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    printed = ended.stdout if ended.returncode == 0 else ended.stderr.strip().split("\n")[-1]
    message = printed.strip() or f"exit status {ended.returncode}"
    message = message.replace(str(part), job.output)
    state = "done" if ended.returncode == 0 and part.exists() else "failed"
    if state == "done" and not output.exists():
        part.rename(output)
    shutil.rmtree(folder, ignore_errors=True)
    duration_s = time.monotonic() - begin
    return JobResult(job=job, state=state, message=message, duration_s=duration_s)


def remove_leftovers(jobs: Sequence[Job]) -> None:
    """Remove partial results of crashed workers, after all jobs have ended."""
    for folder, run in {(Path(job.output).parent, job.run) for job in jobs}:
        for part in folder.glob(f".part-{run}-*"):
            shutil.rmtree(part, ignore_errors=True)


def summary(outcomes: Sequence[JobResult]) -> Table:
    """Summary of all recordings; of many, only the failures and the totals."""
    counts = {
        state: sum(each.state == state for each in outcomes)
        for state in ("done", "there already", "failed")
    }
    table = Table("recording", "", "[s]", "", box=None)
    table.caption = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    for each in sorted(outcomes, key=lambda each: each.job.recording):
        if len(outcomes) <= SHOWN or each.state == "failed":
            table.add_row(each.job.recording, each.state, f"{each.duration_s:.1f}", each.message)
    return table


def _command(given: Sequence[str], source: Path, target: Path, recording: Path) -> Iterator[str]:
    """The tool's command for one recording, without the options for many."""
    yield sys.executable
    words = iter(given)
    for word in words:
        name, has_value, _ = word.partition("=")
        if name in ("--jobs", "--dask"):
            if not has_value:
                next(words, None)
        elif Path(word) == source:
            yield str(recording)
        else:
            yield OUTPUT if Path(word) == target else word


@contextmanager
def _dask_executor(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError as error:
        raise PoseError(f"--dask needs Dask, which is not installed: {INSTALL_DASK}") from error
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address}: {one_line(error)}; start one with "
            "'dask scheduler', and 'dask worker' where ./pose build has been run"
        ) from error
    with client:
        # If a worker crashes, the scheduler gives its jobs to another.
        yield client.get_executor(pure=False, retries=2)
