"""Work: what takes time for a bench, in processes of its own. Public: the tasks, `worker_pool.TaskQueue`."""
