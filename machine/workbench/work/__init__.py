"""Work: long tasks of a bench, in worker processes. Public: the tasks, `worker_pool.TaskQueue`."""
