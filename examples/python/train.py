"""Learns to fly through a forest by ranges: PPO (Schulman et al., arXiv 1707.06347) on the distribution's torch.

    python3 train.py forest.pfmap policy.npz [CPU SECONDS [SEED]]
"""

import math
import sys
import time

import numpy as np
import torch
from torch import nn

import pointflight as pf
from pointflight.gym import Lidar, Policy, VectorEnv, evaluate, features, straight

if len(sys.argv) < 3:
    sys.exit(__doc__)
place, output = pf.Map.open(sys.argv[1]), sys.argv[2]
budget, seed = (float(sys.argv[3]) if len(sys.argv) > 3 else 400.0), int(sys.argv[4]) if len(sys.argv) > 4 else 0
lidar = Lidar(3, 60, elevation=(-math.radians(15), math.radians(15)))
torch.manual_seed(seed)
torch.set_num_threads(1)
N, T, GAMMA, BASE = 256, 32, 0.98, 0.8
env = VectorEnv(place, N, lidar=lidar, autoreset="same_step", copy=False)
seen, _ = env.reset(seed=seed * 1_000_000)


def network(width, outputs):
    return nn.Sequential(nn.Linear(width, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, outputs))


x = torch.from_numpy(features(seen, lidar.range_max))
actor, critic = network(x.shape[1], 3), network(x.shape[1], 1)
nn.init.orthogonal_(actor[4].weight, 0.01)
log_std = nn.Parameter(torch.full((3,), -0.9))
optimizer = torch.optim.Adam([*actor.parameters(), *critic.parameters(), log_std], 7e-4)


def policy(about=""):
    layers = [(m.weight.detach().numpy(), m.bias.detach().numpy()) for m in actor if isinstance(m, nn.Linear)]
    return Policy(layers, {"base": BASE, "range_max": lidar.range_max, "rows": 3, "columns": 60, "about": about})


began = time.process_time()
spent = next_look = evaluating = 0.0
while spent < budget:
    X, U, B, LP, V, R, D = [], [], [], [], [], [], []
    for _ in range(T):
        base = torch.from_numpy(BASE * straight(seen)[:, :3])
        with torch.no_grad():
            chosen = torch.distributions.Normal(base + actor(x), log_std.exp())
            u = chosen.sample()
            value = critic(x)[:, 0]
        seen, reward, terminated, truncated, infos = env.step(np.pad(u.numpy(), ((0, 0), (0, 1))))
        X, U, B, V = [*X, x], [*U, u], [*B, base], [*V, value]
        LP, R, D = [*LP, chosen.log_prob(u).sum(1)], [*R, reward], [*D, terminated | truncated]
        x = torch.from_numpy(features(seen, lidar.range_max))
    with torch.no_grad():
        V = [*V, critic(x)[:, 0]]
    gain, A = torch.zeros(N), [None] * T
    for t in reversed(range(T)):  # generalised advantages (Schulman et al., arXiv 1506.02438)
        live = torch.from_numpy(1.0 - D[t].astype(np.float32))
        gain = torch.from_numpy(R[t].astype(np.float32)) + GAMMA * V[t + 1] * live - V[t] + GAMMA * 0.95 * live * gain
        A[t] = gain
    G = torch.cat([a + v for a, v in zip(A, V)])
    X, U, B, LP, A = (torch.cat(many) for many in (X, U, B, LP, A))
    for group in optimizer.param_groups:
        group["lr"] = 7e-4 * (1 - 0.9 * min(1.0, spent / budget))
    for _ in range(4):
        for k in torch.randperm(N * T).split(2048):
            chosen = torch.distributions.Normal(B[k] + actor(X[k]), log_std.exp())
            ratio = (chosen.log_prob(U[k]).sum(1) - LP[k]).exp()
            a = (A[k] - A[k].mean()) / (A[k].std() + 1e-8)
            loss = -torch.min(ratio * a, ratio.clamp(0.8, 1.2) * a).mean() - 0.002 * chosen.entropy().sum(1).mean()
            loss = loss + 0.5 * (critic(X[k])[:, 0] - G[k]).pow(2).mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_([*actor.parameters(), *critic.parameters()], 0.5)
            optimizer.step()
    spent = time.process_time() - began - evaluating
    if spent >= next_look or spent >= budget:
        looked = time.process_time()
        test = VectorEnv(place, 100, lidar=lidar, autoreset="disabled")
        score = evaluate(test, policy(), range(20_000_000, 20_000_100))
        print(f"{spent:.0f} s: {score.arrived} of 100 arrive, {score.collided} collide", flush=True)
        policy(f"{spent:.0f} CPU s, seed {seed}").save(output)
        evaluating += time.process_time() - looked
        next_look = spent + budget / 10
