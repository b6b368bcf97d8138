"""Many runs of one model, which differ in parameters, initial values and inputs, asked as one question."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from msgspec.structs import replace

from ...case import SimulationOptions
from ...ensembles.batches import Other
from ...ensembles.device import MakeItems
from ...ensembles.files import PiecesFolder
from ...ensembles.kept import Kept, check_kept, kept_by_default
from ...ensembles.kernel_arguments import TRIED
from ...ensembles.lanes import CHOICES, Wanted
from ...ensembles.members import SAMPLINGS, Axis, Listed, Members, Spread, members_of
from ...ensembles.recipe import Make, Recipe
from ...ensembles.result import Ensemble
from ...ensembles.run import run_ensemble
from ...inputs import Table
from ...nominal import with_nominal
from ...outcome import SimulationError
from ...problem import Problem
from ...settings import settable
from ..runs.own_size import sizes_in_run
from ..runs.simulate import as_keywords, plan_run
from ..study import Study, swept_axes

if TYPE_CHECKING:
    from ...ensembles.cluster import Cluster

TWENTIETH = 0.05
Varying = Axis | Spread | Listed
"""What differs between members."""


class EnsembleOf(Study, frozen=True, kw_only=True):
    """The members of a product of values, a cloud of random values, or a list. The answer is an ``Ensemble``.

    Values that the experiment sweeps and ``vary`` does not name are axes as well, the first ones. ``others``: the model built otherwise
    (``ensembles/batches.py``).
    """

    of_past = True
    unused: ClassVar[frozenset[str]] = frozenset({"estimate_error"})
    sweeps: ClassVar[bool] = True
    of_members: ClassVar[bool] = True

    vary: Annotated[
        tuple[Varying, ...],
        settable("Quantities that vary: ranges, values, distributions, or a CSV file of members.", "varying"),
    ] = ()
    samples: Annotated[int | None, settable("Number of random members.", "count")] = None
    seed: Annotated[int, settable("Seed of the random numbers (default: 1).", "count")] = 1
    sampling: Annotated[str, settable("plain, latin (hypercube) or sobol.", "text")] = "plain"
    covariance: Annotated[
        tuple[tuple[float, ...], ...],
        settable("Covariance, in SI, of the normal distributions that are given by a mean alone.", "matrix"),
    ] = ()
    keep: Annotated[
        tuple[Kept, ...],
        settable(
            "Results to keep: final, max, min, mean, rms of a formula, first(condition), events(kind), lyapunov(time); a formula alone over time.",
            "kept",
        ),
    ] = ()
    errors: Annotated[
        float, settable("Members whose error is estimated: all, none or a fraction (default: 0.05).", "share")
    ] = TWENTIETH
    threads: Annotated[int | None, settable("Threads (default: all processors).", "count")] = None
    lanes: Annotated[
        str,
        settable(
            "Several members at once in vector registers: auto (from 1000 members on), on or off.", "text"
        ),
    ] = "auto"
    device: Annotated[
        str | None,
        settable("Device that runs the members, one per work item: opencl, or opencl:NAME.", "text"),
    ] = None
    store: Annotated[
        str | None, settable("Output file; finished members are kept next to it until all are done.", "text")
    ] = None
    resume: Annotated[bool, settable("Continue with the members that an earlier run has kept.", "flag")] = (
        False
    )
    time_limit: Annotated[
        float | None,
        settable("Longest wall-clock time of a member, in seconds (default: no limit).", "seconds"),
    ] = None
    workers: Annotated[
        int | None, settable("Number of Dask worker processes to start on this machine.", "count")
    ] = None
    cluster: Annotated[
        Any,
        settable(
            "Address of a Dask scheduler whose workers run the members; in Python also a client.", "cluster"
        ),
    ] = None
    others: tuple[Other, ...] = ()
    few_steps: int | None = None
    make_lanes: Callable[[Wanted, str], Path] | None = None
    make_items: MakeItems | None = None
    send: Callable[[EnsembleOf], Make] | None = None
    """Gives what makes the recipe of this question in another process."""
    sizes: tuple[tuple[str, float], ...] = ()
    """Nominal values of states that stay far below those of others, as a run of the first member that can run finds them."""

    def solve(self, problem: Problem) -> Ensemble:
        """Run all members. Raises SimulationError for members or things to keep that do not fit the model."""
        kept = self.keep or kept_by_default(problem)
        check_kept(problem, kept)
        members = self.members(problem)
        if self.resume and not self.store:
            raise SimulationError(
                "'resume' continues what an earlier run has kept, but no file is named",
                help="name it by --output, or by store in Python",
            )
        if self.lanes not in CHOICES:
            raise SimulationError(
                f"'lanes' is {' or '.join(CHOICES)}, not '{self.lanes}'",
                help="without it, lanes are used for many members if the model supports them",
            )
        if self.device is not None:
            self._check_device()
        pieces = None
        if self.store:
            pieces = PiecesFolder(Path(self.store), self._fingerprint(problem, members), resume=self.resume)
        sized = replace(self, sizes=tuple(self._sizes(problem, members).items()))
        recipe = sized.recipe(problem)
        with sized._elsewhere(members) as elsewhere:
            found = run_ensemble(recipe, members, threads=self.threads, pieces=pieces, elsewhere=elsewhere)
        if pieces is not None and found.complete:
            pieces.remove()
        return found

    def _check_device(self) -> None:
        """Raise SimulationError for what members on a device cannot have."""
        why = {
            "lanes": "lanes are those of this processor" if self.lanes != "auto" else "",
            "time_limit": "many go on together there, and none is ended alone" if self.time_limit else "",
            "workers": "the device is one of this machine" if self.workers else "",
            "cluster": "the device is one of this machine" if self.cluster is not None else "",
        }
        for name, reason in why.items():
            if reason:
                raise SimulationError(
                    f"'{name}' does not go with members on a device: {reason}",
                    help=f"leave '{name}' or 'device' out",
                )
        if self.make_items is None:
            raise SimulationError("a problem that was written by hand has no text for devices")

    def recipe(self, problem: Problem) -> Recipe:
        """Say how members are made."""

        def sized(made: Problem | None) -> Problem | None:
            return made if made is None else with_nominal(made, dict(self.sizes))

        def other(one: Other) -> Other:
            return replace(one, make=lambda: sized(one.make()))

        return Recipe(
            with_nominal(problem, dict(self.sizes)),
            self,
            self.keep or kept_by_default(problem),
            self.errors,
            self.time_limit,
            tuple(map(other, self.others)) if self.sizes else self.others,
            self.few_steps,
            self.make_lanes,
            self.lanes,
            self.make_items,
            self.device,
        )

    def _sizes(self, problem: Problem, members: Members) -> dict[str, float]:
        """Give the nominal values of states that stay far below those of others in the first member that can run."""
        for k in range(min(TRIED, members.count)):
            row = members.values(k, k + 1)[0].tolist()
            values = {**self.values, **dict(zip(members.names, row, strict=True))}
            given = {**as_keywords(self), "values": values, "progress": None, "estimate_error": False}
            options = SimulationOptions(**{**given, "max_steps": self.few_steps or self.max_steps})
            try:
                return sizes_in_run(plan_run(problem, options))
            except SimulationError:
                continue
        return {}

    @contextmanager
    def _elsewhere(self, members: Members) -> Iterator[Cluster | None]:
        """Give the cluster that was asked for. Raises SimulationError."""
        if self.cluster is None and self.workers is None:
            yield None
            return
        from ...ensembles.cluster import Cluster, connected

        if self.send is None:
            raise SimulationError("a problem that was written by hand cannot be sent to a cluster")
        with connected(self.cluster, self.workers, self.threads) as client:
            yield Cluster(client, self.send(self), members, self.reproducible, self.threads)

    def _fingerprint(self, problem: Problem, members: Members) -> str:
        """Give what tells this question from others: pieces of one are none of another."""
        digest = sha256(problem.library.read_bytes() if problem.library else b"")
        for axis in members.axes:
            digest.update(axis.name.encode() + axis.values.tobytes())
        if members.cloud is not None:
            digest.update(repr(members.cloud.names).encode() + members.cloud.rows.tobytes())
        own = {
            "progress",
            "threads",
            "store",
            "resume",
            "others",
            "few_steps",
            "make_lanes",
            "make_items",
            "send",
            "sizes",
            "time_limit",
            "workers",
            "cluster",
            "vary",
            "inputs",
        }
        asked = {name: getattr(self, name) for name in self.__struct_fields__ if name not in own}
        tables = {
            name: (t.times.tobytes(), t.values.tobytes())
            for name, t in self.inputs.items()
            if isinstance(t, Table)
        }
        digest.update(repr((sorted(asked.items()), sorted(tables.items()))).encode())
        return digest.hexdigest()

    def members(self, problem: Problem) -> Members:
        """Make the members. Raises SimulationError."""
        if self.sampling not in SAMPLINGS:
            raise SimulationError(
                f"there is no sampling '{self.sampling}'", help=f"there are {', '.join(SAMPLINGS)}"
            )
        named = {
            name for one in self.vary for name in (one.names if isinstance(one, Listed) else (one.name,))
        }
        units = {q.name: q.unit for q in (*problem.parameters, *problem.states, *problem.inputs)}
        swept = [
            Axis(name, units[name], np.array(values))
            for name, values in swept_axes(problem, self).items()
            if name not in named
        ]
        given = list(self.vary)
        twice = [n for one in given for n in (one.names if isinstance(one, Listed) else (one.name,))]
        for name in twice:
            if twice.count(name) > 1:
                raise SimulationError(f"'{name}' varies twice")
            if name in self.values:
                raise SimulationError(f"'{name}' varies, and is set to one value as well")
        listed = [one for one in given if isinstance(one, Listed)]
        if len(listed) > 1:
            raise SimulationError("members are listed twice: take one list")
        covariance = np.array(self.covariance) if self.covariance else None
        return members_of(
            [*swept, *(one for one in given if isinstance(one, Axis))],
            [one for one in given if isinstance(one, Spread)],
            listed[0] if listed else None,
            self.samples,
            self.seed,
            self.sampling,
            covariance,
        )
