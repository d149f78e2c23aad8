"""Union-find inside kernels: sets that grow together, each known by one of its members (paths halved)."""

from mdp.kernels.arrays import ints
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Ints


@helper
def singletons(size: int) -> Ints:
    """The parents of `count` members, none of which have been joined."""
    parent = ints(size, 0)
    for member in range(size):
        parent[member] = member
    return parent


@no_nrt
def root(parent: Ints, member: int) -> int:
    """The member that stands for all that one has been joined with."""
    while parent[member] != member:
        parent[member] = parent[parent[member]]
        member = parent[member]
    return member


@helper
def join(parent: Ints, a: int, b: int) -> None:
    """Join two sets; the lesser of the members that stand for them stands for both."""
    p, q = root(parent, a), root(parent, b)
    parent[max(p, q)] = min(p, q)
