"""How many of 100 forests that nobody has seen pilots and policies cross, in environments; fly_policy.py flies the same
in the full simulation.

    policies.py PROGRAM FOLDER [POLICY.npz ...]   (`./dev bench policies`; makes the forests in FOLDER unless they are there)
"""

import os
import subprocess
import sys

from pointflight.gym import Lidar, Policy, VectorEnv, evaluate, reactive, straight

SEEDS = range(30_000_000, 30_000_100)


def forests(program: str, folder: str) -> list:
    """Paths of 100 maps."""
    os.makedirs(folder, exist_ok=True)
    made = []
    for seed in range(1001, 1101):
        place, cloud = (os.path.join(folder, f"forest_{seed}.{kind}") for kind in ("pfmap", "pcd"))
        made.append(place)
        if os.path.exists(place):
            continue
        print(f"\rforest {seed - 1000} of 100", end="", file=sys.stderr, flush=True)
        size = ("--size-x", "42", "--size-y", "32", "--trees", "1000", "--density", "400")
        quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.run([program, "map", "forest", *size, "--seed", str(seed), "-o", cloud, "--force"], **quiet)
        subprocess.run([program, "map", "import", cloud, "-o", place, "--resolution", "0.06", "--force"], **quiet)
        os.remove(cloud)
    print(file=sys.stderr)
    return made


def main() -> None:
    maps = forests(sys.argv[1], sys.argv[2])

    def fly(name, lidar, pilot_of) -> None:
        env = VectorEnv(maps, len(maps), lidar=lidar, autoreset="disabled")
        print(f"{name}: {evaluate(env, pilot_of(env), SEEDS)}", flush=True)

    fly("straight", None, lambda env: straight)
    fly("reactive", Lidar(1, 180, (-0.03, 0.03)), reactive)
    for path in sys.argv[3:]:
        policy = Policy.load(path)
        fly(path, policy.lidar, lambda env: policy)


if __name__ == "__main__":
    main()
