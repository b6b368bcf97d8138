"""What Python says of the kernel's methods without asking it (``runtime/methods.py``) is what they do."""

from __future__ import annotations

import re

import pytest
from kernel_driver import Model, run
from kernel_models import COUPLED_PENDULUM, PENDULUM, TWO_SPRINGS

from mechc.cli.run import command as run_command
from mechc.runtime.methods import KERNEL_METHODS, methods_for, parts_for, with_components
from mechc.runtime.native import kernel as native
from mechc.runtime.native.kernel import kernel_sources
from mechc.runtime.native.status import Status

PLACE = "runtime/methods.py"
LISTED = re.findall(
    r"&mech_(\w+)", kernel_sources()["methods.c"].split("mech_methods[] = {")[1].split("}")[0]
)
"""The methods in the table of methods.c."""
EVERY = pytest.mark.parametrize("method", LISTED)


def test_each_method_has_its_row() -> None:
    assert set(LISTED) == set(KERNEL_METHODS), f"KERNEL_METHODS in {PLACE}, and methods.c of the kernel"


def test_the_kernel_lists_them() -> None:
    assert list(native.kernel_methods(native.load_kernel())) == LISTED


@EVERY
def test_it_says_where_it_stands(method: str) -> None:
    row, sources = KERNEL_METHODS[method], kernel_sources()
    file = row.file or f"{method}.c"
    assert file in sources, f"the file of '{method}' in {PLACE}"
    plain = f"mech_method mech_{method} = {{" in sources[file]
    assert plain != bool(row.file), f"the file of '{method}' in {PLACE}: only where a macro makes it"
    assert method.rstrip("0123456789") in sources[file], f"the file of '{method}' in {PLACE}"


@EVERY
def test_it_says_what_it_consists_of(method: str) -> None:
    text = kernel_sources()[KERNEL_METHODS[method].file or f"{method}.c"]
    components = re.findall(r"\.(?:explicit|implicit)_part = &mech_(\w+)", text)
    assert list(KERNEL_METHODS[method].consists_of) == components, f"'consists_of' of '{method}' in {PLACE}"


@EVERY
def test_it_says_who_chooses_the_step(method: str) -> None:
    kernel = native.load_kernel()
    adaptive = bool(kernel.mech_method_is_adaptive(kernel.mech_method_index(method.encode())))
    assert KERNEL_METHODS[method].fixed_step != adaptive, f"'fixed_step' of '{method}' in {PLACE}"


@EVERY
def test_it_says_whether_it_works_on_the_jacobian(method: str) -> None:
    """The models are such that those that can do without it where it does not pay work on it."""
    pendulum = run(PENDULUM, method, (1.0, 0.0), 0.5, step=0.1)
    springs = run(TWO_SPRINGS, method, (1.0, 1.0, 0.0, 0.0), 50.0, step=0.5, p=(1e6, 1e4))
    coupled = run(COUPLED_PENDULUM, method, (0.1, 0.5, 0.0, 0.3), 0.5, step=0.1, p=(1.0,))
    done = [one for one in (pendulum, springs, coupled) if one.status == Status.REACHED]
    assert done or KERNEL_METHODS[method].solves_contacts  # these have none
    works = any(one.report["jacobians"] > 0 for one in done)
    assert works == ("jacobian" in parts_for(method)), f"'parts' of '{method}' in {PLACE}"


@EVERY
def test_it_says_whether_it_works_on_momenta(method: str) -> None:
    bare = Model({"rhs": "out[0] = y[1]; out[1] = -y[0];"}, nq=1, nv=1)
    status = run(bare, method, (1.0, 0.0), 1.0, step=0.1).status
    assert (status == Status.NEEDS_MOMENTA) == ("momenta" in parts_for(method)), (
        f"'parts' of '{method}' in {PLACE}"
    )
    if status == Status.NEEDS_JACOBIAN:
        assert "jacobian" in parts_for(method)


def test_parts_bring_their_methods() -> None:
    assert with_components("auto") == ("auto", "dop853", "radau5")
    assert methods_for({"momenta"}) == ["rattle", "lobatto4", "lobatto6"]
    assert methods_for({"jacobian"})[:3] == ["auto", "dop853", "radau5"]
    assert methods_for({"projection"}) == []
    assert parts_for("no method") == frozenset()


@EVERY
def test_the_command_line_tells_it(method: str) -> None:
    """By its name, or as one of ``gauss2 to gauss8``."""
    (option,) = (p for p in run_command.params if p.name == "method")
    words = str(getattr(option, "help", ""))
    family = re.search(rf"{method.rstrip('0123456789')}(\d+) to \w+?(\d+)", words)
    told = re.search(rf"\b{method}\b", words)
    inside = family is not None and int(family[1]) <= int(method[-1]) <= int(family[2])
    assert told or inside, f"'{method}' is not in the words of --method: mechc/cli/run.py"
