"""The twins that there are."""

from __future__ import annotations

from collections.abc import Mapping

from .answers import answers_written_out
from .clocks import actions_reordered, clocks_counted, steps_ended, times_as_a_state
from .closing import joint_as_closure
from .coordinates import other_coordinates
from .energies import bodies_as_energies, energies_as_forces
from .flattened_inheritance import inheritance_expanded
from .functions import functions_otherwise
from .kinks import kinks_by_choice
from .nominal import nominal_sizes
from .order import in_another_order
from .parts import integrals_in_parts
from .perturbed_start import start_perturbed
from .powers import powers_written_out
from .reversal import time_reversed
from .sizes import other_units
from .stated import starts_elsewhere
from .tables import tables_in_pieces
from .twin import Make
from .world import turned_world
from .written_out import written_out

TWINS: Mapping[str, Make] = {
    "another order": in_another_order,
    "kinks by if": kinks_by_choice,
    "energies as forces": energies_as_forces,
    "bodies as energies": bodies_as_energies,
    "answers written out": answers_written_out,
    "powers written out": powers_written_out,
    "integrals in parts": integrals_in_parts,
    "functions otherwise": functions_otherwise,
    "tables in pieces": tables_in_pieces,
    "clocks counted": clocks_counted,
    "times as a state": times_as_a_state,
    "steps ended": steps_ended,
    "actions reordered": actions_reordered,
    "starts elsewhere": starts_elsewhere,
    "inheritance expanded": inheritance_expanded,
    "nominal sizes": nominal_sizes,
    "written out": written_out,
    "turned world": turned_world,
    "other units": other_units,
    "joint as closure": joint_as_closure,
    "other coordinates": other_coordinates,
    "time reversed": time_reversed,
    "start perturbed": start_perturbed,
}
