"""Systems that the tests and examples of other programs have, as mech models beside what those programs form of them."""
