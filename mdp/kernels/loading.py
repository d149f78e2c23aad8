"""Loading: a kernel's machine code comes from the cache without what numba prepares for compiling.

Whenever numba loads machine code it imports everything that it can compile, compiles its runtime, parses the kernel's LLVM code
and lists its symbols: .4 s for the 58 kernels of an export, and 28 MB of LLVM. That waits until a kernel is compiled, which most
runs never do.
"""

from typing import Any

from llvmlite.binding import add_symbol, parse_bitcode
from numba.core.codegen import JITCodeLibrary
from numba.core.runtime import _nrt_python


class LoadedLibrary(JITCodeLibrary):
    """A library of machine code; one that comes from the cache parses its LLVM code when another kernel is compiled with it."""

    _bitcode = b""
    _shared_module: Any

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        library = cls(codegen, name)
        machine_code, library._bitcode = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        return library

    def _get_module_for_linking(self) -> Any:
        if self._bitcode and self._shared_module is None:
            self._shared_module = parse_bitcode(self._bitcode)
        return super()._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function of the library."""
        if self._bitcode:
            address: int = self._codegen._engine.get_function_address(name)
            return address
        return int(super().get_pointer_to_function(name))


def prepare_loading(context: Any) -> None:
    """What numba's target context needs before it loads machine code, which calls the functions of numba's runtime by name."""
    if context.codegen()._library_class is not LoadedLibrary:
        for name, address in _nrt_python.c_helpers.items():
            add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        context.codegen()._library_class = LoadedLibrary
