"""The domain of a case in its part, with the components of the core."""

from gradedesign.design.resolve.component_place import component_place
from gradedesign.geometry.lattice.component_kind import builtin_components, composed

KINDS = {kind.name: kind for kind in builtin_components()}


def design_domain(case, part):
    """Domain of a case that is analysed, without its cuts."""
    return composed(component_place(case, part), KINDS)
