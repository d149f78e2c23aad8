"""Library: how numba makes machine code here: what only kernels call is optimised and becomes code with them alone.

numba optimises every function with all its callees and makes machine code of it before it is linked into its callers, which
optimise and compile it once more: with a kernel of parts of parts that is most of LLVM's work. A library of functions that Python
does not call waits as intermediate code here until it is linked into a kernel. Should its address be asked for all the same,
its code is made then.

Two methods of numba's own class are put off, under names that it has had in all versions that pyproject.toml allows; where a
version has them no more, its libraries stay as they are. What is compiled is the same, so is every number that it gives.
numba also compares its options a hundred thousand times on the way, asking each by itself: here a dict is asked once.
"""

from functools import cache
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags
from numba.core.environment import lookup_environment
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig

PUT_OFF = ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals", "get_pointer_to_function")
ENVIRONMENT, CALLED_FROM_PYTHON = "_ZN08NumbaEnv", "_ZN7cpython"  # how names begin: of a function's constants, of its entry


class KernelLibrary(JITCodeLibrary):
    """As numba's, but without machine code as long as Python has no entry to it."""

    _waits = False

    def _optimize_final_module(self) -> None:
        """Optimise a kernel; a part waits."""
        if not self._is_part():
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        """Make machine code of a kernel, and tell it where the constants of the parts in it are; a part waits."""
        if self._is_part():
            self._finalize_dynamic_globals()
            self._waits = self._finalized = True
            return
        super()._finalize_final_module()
        for name in _environments(self._final_module):
            environment = lookup_environment(name)
            if environment is not None:
                self._codegen.set_env(name, environment)

    def get_pointer_to_function(self, name: str) -> int:
        """The address of a function; 0 where it has none. A part that is asked for one waits no longer."""
        self._ensure_finalized()
        if self._waits:
            if all(function.name != name for function in self.get_defined_functions()):
                return 0
            self._waits = False
            super()._optimize_final_module()
            super()._finalize_final_module()
        address: int = super().get_pointer_to_function(name)
        return address

    def _is_part(self) -> bool:
        """Whether it holds compiled Python that only compiled Python calls; what came from the cache is code already."""
        if self._disable_inspection:
            return False
        own = [function.name for function in self._final_module.functions if not function.is_declaration]
        return bool(_environments(self._final_module)) and not any(name.startswith(CALLED_FROM_PYTHON) for name in own)


def use_kernel_libraries() -> None:
    """Have all functions that are compiled from now on go into such libraries."""
    codegen: Any = cpu_target.target_context.codegen()
    if codegen._library_class is not JITCodeLibrary or not all(hasattr(JITCodeLibrary, name) for name in PUT_OFF):
        return
    set_env = codegen.set_env

    def set_known_env(name: str, environment: Any) -> None:
        """A part that waits has no place for its constants yet: its kernel will have."""
        if codegen._engine.get_global_value_address(name):
            set_env(name, environment)

    codegen._library_class, codegen.set_env = KernelLibrary, set_known_env


def use_plain_options() -> None:
    """Have numba compare its options by their dict, where it keeps them in one."""
    example = Flags()
    if hasattr(example, "_values") and option_values(example) == example.values():
        TargetConfig.values = option_values


def option_values(config: Any) -> dict[str, Any]:
    """What TargetConfig.values() gives: those that were set, and the defaults of the others."""
    kind: Any = type(config)
    values: dict[str, Any] = _defaults(kind) | config._values
    return values


@cache
def _defaults(kind: Any) -> dict[str, Any]:
    return {name: option.default for name, option in kind.options.items()}


def _environments(module: Any) -> list[str]:
    return [variable.name for variable in module.global_variables if variable.name.startswith(ENVIRONMENT)]
