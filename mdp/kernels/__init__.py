"""Kernels: functions compiled by numba, the arrays they need, where they are cached, and threads that run them."""
