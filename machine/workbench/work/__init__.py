"""Work: what takes time for a bench, in processes of its own. Public: `tasks.TASKS`, `worker_pool.TaskQueue`."""
