"""Runs a stress study as tasks of PyPI's `hyperqueue`, on a server with two workers of which one is killed; for tests/sweep.rs.

usage: hyperqueue_sweep.py WAYHOME STUDY.toml SHARDS FOLDER

Each shard is a task with a folder of its own. When one worker is in the middle of a shard, its process and the task's are
killed at once, as if the machine had gone; HyperQueue has to start the task again on the other worker. Then the shards are
merged into FOLDER/merged. The last line printed is, as JSON, each attempt at a shard: shard, instance, worker.

The package has HyperQueue itself, but not its program `hq`; what it offers to start workers starts them in the process of the
server. So each worker here is a process with a server that nobody asks anything, beside which it makes a worker for the server
that counts: a worker finds its server by the folder's link `hq-current`.
"""

import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

from hyperqueue import Client, Job
from hyperqueue.cluster import LocalCluster, WorkerConfig

CURRENT = "hq-current"
PATIENCE_S = 300


def work(server, own):
    """Is a worker of one core of the server with that folder, until standard input ends."""
    try:
        cluster = LocalCluster(own)
        link = pathlib.Path(own, CURRENT)
        link.unlink()
        link.symlink_to(pathlib.Path(server, CURRENT).resolve())
        cluster.start_worker(WorkerConfig(cores=1))
        print("ready", flush=True)
        sys.stdin.read()
    finally:
        os._exit(0)  # whatever the threads of server and worker do


def start_worker(folder, name):
    arguments = [sys.executable, __file__, "--worker", folder / "server", folder / name]
    (folder / name).mkdir()
    worker = subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    # Before that line stands what its server tells of itself.
    assert "ready\n" in iter(worker.stdout.readline, ""), f"{name} did not start"
    return worker


def attempts(folder):
    """Of each start of a shard: shard, instance of the task, process of the worker, process of the task."""
    known = []
    for path in sorted(folder.glob("attempts-*")):
        for line in path.read_text().splitlines(keepends=True):
            if line.endswith("\n"):
                known.append([int(path.name.split("-")[1]), *map(int, line.split())])
    return known


def kill_midway(folder, worker):
    """Kills a worker and its task when the task has written the first of its chunks."""
    while True:
        for shard, _, parent, task in attempts(folder):
            running = pathlib.Path(f"/proc/{task}/cmdline")
            rows = list((folder / f"shard-{shard}").glob("parts/*.parquet"))
            if parent == worker.pid and len(rows) == 1 and running.exists() and b"sweep" in running.read_bytes():
                worker.send_signal(signal.SIGKILL)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(task, signal.SIGKILL)
                worker.wait()
                return
        time.sleep(0.005)


def main(wayhome, study, shards, folder):
    signal.alarm(PATIENCE_S)  # ends this process, whatever it waits for; its workers end with it
    folder = pathlib.Path(folder).resolve()
    (folder / "server").mkdir(parents=True)
    with LocalCluster(str(folder / "server")) as cluster:
        workers = [start_worker(folder, name) for name in ("worker-1", "worker-2")]
        job = Job(max_fails=0)
        for shard in range(1, int(shards) + 1):
            script = f'echo "$HQ_INSTANCE_ID $PPID $$" >> attempts-{shard}; exec "$@"'
            sweep = [wayhome, "sweep", study, "--shard", f"{shard}/{shards}", "--threads", "1", "--out", f"shard-{shard}"]
            job.program(["sh", "-c", script, "sh", *sweep], cwd=folder, crash_limit=5)
        client = cluster.client()
        submitted = client.submit(job)
        kill_midway(folder, workers[0])
        client.wait_for_jobs([submitted])
        workers[1].stdin.close()
        workers[1].wait()
    parts = [str(folder / f"shard-{shard}") for shard in range(1, int(shards) + 1)]
    subprocess.run([wayhome, "sweep", "merge", *parts, "--out", folder / "merged"], check=True, stdout=subprocess.DEVNULL)
    names = {worker.pid: f"worker-{number}" for number, worker in enumerate(workers, 1)}
    told = [{"shard": shard, "instance": instance, "worker": names[parent]} for shard, instance, parent, _ in attempts(folder)]
    print(json.dumps({"attempts": told}))


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        work(*sys.argv[2:])
    else:
        main(*sys.argv[1:])
