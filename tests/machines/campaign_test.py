#!/usr/bin/env python3
"""A campaign on each engine, and one that is killed again and again: the same table.

campaign_test.py PROGRAM MAP.pfmap [FLIGHTS [KILLS]]: local processes, Open MPI or MPICH, Slurm with two
virtual nodes on this machine (slurm.sh). Engines that are not there are left out, which is said."""
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

program, pfmap = (os.path.abspath(path) for path in sys.argv[1:3])
flights = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
kills = int(sys.argv[4]) if len(sys.argv) > 4 else 10
here = pathlib.Path(__file__).resolve().parent
work = pathlib.Path(tempfile.mkdtemp(prefix="pointflight_campaign_"))
SCENARIO = """map: {map}
duration: 0.4
vehicle: {{start: [12, 10, 6]}}
lidars: []
mission: {{waypoints: [[14, 10, 6]]}}
obstacles:
  - {{motion: random, count: 20, radius: 0.4, speed: 2, bounds_min: [6, 4, 4], bounds_max: [18, 16, 8]}}
output: {{scans: false, imu: false}}
"""
STUDY = """scenario: s.yaml
seeds: {seeds}
grid:
  mission.speed: [1, 2]
  obstacles[0].count: {{from: 0, to: 80, n: 5}}
"""


def run(words, **options):
    result = subprocess.run(words, cwd=work, text=True, capture_output=True, **options)
    assert result.returncode == 0, f"{' '.join(map(str, words))}: {result.returncode}\n{result.stderr[-2000:]}"
    return result


def table(folder):
    return (work / folder / "runs.csv").read_bytes()


def fly_and_kill(words, most, longest, **options):
    """Killed at random moments, by the hardest signal; each time the same command goes on."""
    rng = random.Random(1)
    count = 0
    while count < most:
        child = subprocess.Popen(words, cwd=work, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **options)
        try:
            child.wait(rng.uniform(0.05, longest))
        except subprocess.TimeoutExpired:
            child.send_signal(signal.SIGKILL)
            child.wait()
            count += 1
            continue
        said = child.stderr.read()
        if child.returncode == 0:
            break
        # what was killed may hold the folder for a moment more
        assert "in use" in said or "another" in said, said[-2000:]
    for _ in range(100):
        result = subprocess.run(words, cwd=work, text=True, capture_output=True, **options)
        if result.returncode == 0:
            return count
        assert "in use" in result.stderr or "another" in result.stderr, result.stderr[-2000:]
        time.sleep(0.2)
    raise AssertionError("the folder stays taken: " + result.stderr[-500:])


def command(folder, *more):
    return [program, "campaign", "study.yaml", "-o", folder, *more]


# as root in a container, more ranks than cores: Open MPI asks to be told
MPI = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
           OMPI_MCA_rmaps_base_oversubscribe="1")


def mpi_words(folder):
    return ["mpirun", "-np", "3", *command(folder, "--engine", "mpi")]


def mpi():
    if not shutil.which("mpirun"):
        return None
    run(mpi_words("mpi"), env=MPI)
    return "mpi"


def mpi_killed():
    if not shutil.which("mpirun"):
        return None
    fly_and_kill(mpi_words("mpi_killed"), kills, 3.0, env=MPI)
    return "mpi_killed"


def slurm():
    result = subprocess.run([here / "slurm.sh", *command("slurm", "--engine", "slurm", "--tasks", "8")], cwd=work,
                            text=True, capture_output=True)
    if result.returncode == 77:
        print(result.stdout.strip())
        return None
    assert result.returncode == 0, result.stdout[-1000:] + result.stderr[-2000:]
    return "slurm"


def slurm_whose_coordinator_dies():
    """The job goes on; the same command waits for it, and sends no second one."""
    script = f"""
{' '.join(command('orphan', '--engine', 'slurm', '--tasks', '4'))} >/dev/null 2>&1 &
for i in $(seq 300); do [ -s orphan/slurm/job ] && break; sleep 0.1; done
kill -KILL $!
wait
job=$(cat orphan/slurm/job)
{' '.join(command('orphan', '--engine', 'slurm', '--tasks', '4'))}
[ "$job" = "$(cat orphan/slurm/job)" ]
"""
    result = subprocess.run([here / "slurm.sh", "bash", "-ec", script], cwd=work, text=True, capture_output=True)
    if result.returncode == 77:
        return None
    assert result.returncode == 0, result.stdout[-1000:] + result.stderr[-2000:]
    return "orphan"


try:
    (work / "s.yaml").write_text(SCENARIO.format(map=pfmap))
    (work / "study.yaml").write_text(STUDY.format(seeds=flights // 10))
    begin = time.time()
    run(command("local"))
    wanted = table("local")
    assert wanted.count(b"\n") == 1 + flights // 10 * 10, wanted.count(b"\n")
    print(f"local: {flights // 10 * 10} flights in {time.time() - begin:.0f} s")
    done = fly_and_kill(command("killed"), kills, 1.5)
    assert table("killed") == wanted, "the table of the campaign that was killed"
    print(f"killed {done} times and gone on: the same table")
    for engine in (mpi, mpi_killed, slurm, slurm_whose_coordinator_dies):
        begin = time.time()
        folder = engine()
        if folder is None:
            print(f"{engine.__name__}: not there, left out")
            continue
        assert table(folder) == wanted, f"the table of {engine.__name__}"
        assert (work / folder / "points.csv").read_text() == (work / "local" / "points.csv").read_text()
        print(f"{engine.__name__}: the same table, in {time.time() - begin:.0f} s")
finally:
    shutil.rmtree(work, ignore_errors=True)
