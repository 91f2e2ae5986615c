"""The three states of a contact node."""

from __future__ import annotations

from typing import Final

# No contact: the gap is open and the node carries no force.
OPEN: Final = 0
# Contact within the friction limit, |t| < mu p: the tangential motion is elastic and will be recovered. Also contact at
# the limit that has not slipped in the step.
STICK: Final = 1
# Contact at the friction limit, |t| = mu p, that slipped in the step. Without friction every touching node slips.
SLIP: Final = 2
