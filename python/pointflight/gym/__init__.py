"""Learning to fly by what a LiDAR sees, in maps of real places: gymnasium's interfaces, `VectorEnv` and `Env`, and
PettingZoo's, `ParallelEnv`.

Neither is needed; where they are installed, spaces and base classes are theirs.
"""

from .conditions import Conditions
from .courses import TASKS, Corridor, Formation
from .env import Env
from .evaluation import Score, advantages, evaluate, wilson
from .facing import FacingGoal, facing_goal, turned
from .images import Lidar, lidar_of
from .observer import Observer
from .parallel import ParallelEnv
from .pilots import hold, in_formation, reactive, straight, wander
from .policy import Policy, features
from .tasks import Explore, Goal, Hover, Outcome, Race, States, Task
from .vector import AutoresetMode, VectorEnv

__all__ = [
    "AutoresetMode",
    "Conditions",
    "Corridor",
    "Env",
    "Explore",
    "FacingGoal",
    "Formation",
    "Goal",
    "Hover",
    "Lidar",
    "Observer",
    "Outcome",
    "ParallelEnv",
    "Policy",
    "Race",
    "Score",
    "States",
    "TASKS",
    "Task",
    "VectorEnv",
    "advantages",
    "evaluate",
    "facing_goal",
    "features",
    "hold",
    "in_formation",
    "lidar_of",
    "reactive",
    "straight",
    "turned",
    "wander",
    "wilson",
]
