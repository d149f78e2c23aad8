"""Kernels: functions compiled by numba, the arrays they need, where they are cached; threads and processes that run them."""
