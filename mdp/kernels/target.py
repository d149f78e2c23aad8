"""Target: the processor that kernels are compiled for, one for all machines of a kind, so that compiled kernels can be shipped.

x86-64-v3 is what processors of PCs have since 2013 (Intel) and 2015 (AMD); older ones and other kinds compile for themselves.
NUMBA_CPU_NAME names another one.
"""

import os
import sys

import llvmlite
import numba
from llvmlite import binding
from numba import config
from numba.core.registry import cpu_target

COMMON = "x86-64-v3"
INSTRUCTIONS = {
    *("cx16", "sahf", "popcnt", "sse3", "ssse3", "sse4.1", "sse4.2"),
    *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"),
}


def _choose() -> None:
    """Have numba compile for the common target where this processor can run it, unless the environment names another."""
    try:
        known = binding.get_host_cpu_features()
    except RuntimeError:  # a kind of processor that LLVM cannot tell anything of
        return
    named = {"NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"} & os.environ.keys()
    in_use = "_toplevel_target_context" in vars(cpu_target)  # somebody else has kernels in this process
    if not named and not in_use and all(known.get(name) for name in INSTRUCTIONS):
        os.environ.update(NUMBA_CPU_NAME=COMMON, NUMBA_CPU_FEATURES="")  # numba reads them again whenever one has changed
        config.reload_config()


_choose()
# What machine code depends on beside its sources.
TARGET = " ".join(
    [
        f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')} numba {numba.__version__} llvmlite {llvmlite.__version__}",
        *("SVML" * config.USING_SVML, *cpu_target.target_context.codegen().magic_tuple()),
    ]
)
