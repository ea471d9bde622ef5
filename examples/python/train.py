"""Learns to fly by ranges: PPO (Schulman et al., arXiv 1707.06347) on the distribution's torch, on one core."""
import argparse
import json
import time

import numpy as np
import torch
from torch import nn
import pointflight as pf
from pointflight.gym import TASKS, FacingGoal, Lidar, Policy, VectorEnv, advantages, evaluate, features, straight

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("maps", nargs="+", help="to learn in")
parser.add_argument("-o", dest="output", default="policy.npz")
parser.add_argument("--task", default="goal", choices=TASKS)
parser.add_argument("--seconds", type=float, default=400.0, help="of CPU")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--scenario", type=json.loads, default={}, help="JSON: obstacles, air, faults (VectorEnv)")
args = parser.parse_args()
torch.manual_seed(args.seed), torch.set_num_threads(1), pf.set_threads(1)
N, T, GAMMA, BASE = 256, 32, 0.98, 0.0 if args.task in ("hover", "explore") else 0.8  # of the straight way
acts, lidar = 3 if BASE else 4, None if args.task == "hover" else Lidar(3, 60, (-0.26, 0.26), pool=(2, 2))
place = {"map": args.maps, "task": args.task, "lidar": lidar, "scenario": args.scenario}
env = VectorEnv(num_envs=N, autoreset="same_step", copy=False, **place)
env = FacingGoal(env) if args.task in ("goal", "race") else env
seen, _ = env.reset(seed=1_000_000 * args.seed)
x = torch.from_numpy(features(seen, 10.0))
net = lambda n: nn.Sequential(nn.Linear(x.shape[1], 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, n))
actor, critic, log_std = net(acts), net(1), nn.Parameter(torch.full((acts,), -0.9))
nn.init.orthogonal_(actor[4].weight, 0.01), nn.init.orthogonal_(critic[4].weight)
parameters = [*actor.parameters(), *critic.parameters(), log_std]
optimizer, began, looking, looks = torch.optim.Adam(parameters), time.process_time(), 0.0, 0
while (spent := time.process_time() - began - looking) < args.seconds:
    X, U, B, L, V, R, D = ([] for _ in range(7))  # seen, done, base, log-likelihood, value, reward, ended
    for _ in range(T):
        B.append(torch.from_numpy(BASE * straight(seen)[:, :acts]) if BASE else torch.zeros(N, acts))
        with torch.no_grad():
            chosen = torch.distributions.Normal(B[-1] + actor(x), log_std.exp())
            X, U, V = [*X, x], [*U, chosen.sample()], [*V, critic(x)[:, 0]]
        seen, reward, terminated, truncated, _ = env.step(np.pad(U[-1].numpy(), ((0, 0), (0, 4 - acts))))
        L, R, D = [*L, chosen.log_prob(U[-1]).sum(1)], [*R, reward], [*D, terminated | truncated]
        x = torch.from_numpy(features(seen, 10.0))
    values = torch.stack([*V, critic(x)[:, 0].detach()])
    A = torch.from_numpy(advantages(np.stack(R), values.numpy(), np.stack(D), GAMMA, 0.95)).flatten()
    X, U, B, L, G = torch.cat(X), torch.cat(U), torch.cat(B), torch.cat(L), A + values[:-1].flatten()
    optimizer.param_groups[0]["lr"] = 7e-4 * (1.0 - 0.9 * spent / args.seconds)
    for k in (k for _ in range(4) for k in torch.randperm(N * T).split(2048)):
        chosen = torch.distributions.Normal(B[k] + actor(X[k]), log_std.exp())
        ratio, a = (chosen.log_prob(U[k]).sum(1) - L[k]).exp(), (A[k] - A[k].mean()) / (A[k].std() + 1e-8)
        loss = -torch.min(ratio * a, ratio.clamp(0.8, 1.2) * a).mean() - 0.002 * chosen.entropy().sum(1).mean()
        loss = loss + 0.5 * (critic(X[k])[:, 0] - G[k]).square().mean()
        optimizer.zero_grad(), loss.backward(), nn.utils.clip_grad_norm_(parameters, 0.5), optimizer.step()
    if spent >= looks * args.seconds / 12 or time.process_time() - began - looking >= args.seconds:
        looked, looks = time.process_time(), looks + 1
        layers = [(m.weight.detach().numpy(), m.bias.detach().numpy()) for m in actor if isinstance(m, nn.Linear)]
        policy = Policy(layers, {**env.about(), "base": BASE, "seed": args.seed, "cpu_seconds": spent})
        policy.save(args.output)
        test = VectorEnv(num_envs=100 * env.team, autoreset="disabled", **place)
        print(f"{spent:.0f} s:", evaluate(test, policy, range(20_000_000, 20_000_100)), flush=True)
        looking += time.process_time() - looked
