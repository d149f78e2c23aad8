"""Kernels: functions compiled by numba, their arrays and cache, and the threads and processes that run them."""
