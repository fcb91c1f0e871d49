"""Compares the optimizers with pycma and NLopt on test functions.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install cma nlopt numpy
    cargo run --release --example optimizers > results/optimizers.csv
    /tmp/check/bin/python scripts/check_optimizers.py results/optimizers.csv

Prints the evaluations to reach 1e-9 (mean +- SD over 30 seeds) of both, and fails when their
means differ by more than 10 %; BOBYQA's costs must agree to 1e-3 at the tight tolerance.
"""

import csv
import sys

import cma
import nlopt
import numpy as np


def sphere(x):
    return float(np.sum(x**2))


def ellipsoid(x):
    return float(np.sum(1e6 ** (np.arange(len(x)) / (len(x) - 1)) * x**2))


def rosenbrock(x):
    return float(np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2))


def bowl(x):
    q = float(np.sum((1 + np.arange(len(x))) * (x - 0.25) ** 2))
    return 0.3 + q + 0.2 * (np.sum(x) - 0.25 * len(x)) ** 2 + 0.1 * q * q


rows = list(csv.DictReader(open(sys.argv[1])))
failed = False
for name, f, start in (("sphere", sphere, 2.0), ("ellipsoid", ellipsoid, 2.0), ("rosenbrock", rosenbrock, 0.0)):
    for population in (20, 100):
        reached = lambda r: float(r["cost"]) <= 1e-9
        ours = [r for r in rows if r["function"] == name and r["population"] == str(population) and r["method"] == "cmaes"]
        ours = [int(r["evaluations"]) for r in ours if reached(r)]
        theirs = []
        for seed in range(1, 31):
            options = {"popsize": population, "seed": seed, "CMA_active": False, "verbose": -9, "ftarget": 1e-9,
                       "tolfun": 0, "tolfunhist": 0, "tolx": 0, "tolstagnation": 10**6, "maxfevals": 100_000,
                       "tolflatfitness": 10**6}
            es = cma.CMAEvolutionStrategy([start] * 6, 1.0, options)
            es.optimize(f)
            if es.result.fbest <= 1e-9:
                theirs.append(es.result.evaluations)
        ratio = np.mean(ours) / np.mean(theirs)
        failed |= abs(ratio - 1) > 0.1
        print(f"{name:10s} population {population:3d}: ours {np.mean(ours):7.0f} +- {np.std(ours):5.0f} ({len(ours)}/30), "
              f"pycma {np.mean(theirs):7.0f} +- {np.std(theirs):5.0f} ({len(theirs)}/30), ratio {ratio:.3f}")

for r in (r for r in rows if r["method"] == "bobyqa"):
    n, tolerance = int(r["n"]), float(r["seed"])
    opt = nlopt.opt(nlopt.LN_BOBYQA, n)
    opt.set_lower_bounds([-1.0] * n)
    opt.set_upper_bounds([1.0] * n)
    opt.set_initial_step(0.5)
    opt.set_ftol_rel(tolerance)
    opt.set_xtol_rel(tolerance)
    opt.set_min_objective(lambda x, grad: bowl(x))
    opt.optimize(np.zeros(n))
    theirs = opt.last_optimum_value()
    # A loose relative tolerance ends a search at the first small improvement, wherever its path is then: only the tight one
    # tells whether both find the minimum.
    failed |= tolerance < 1e-6 and abs(float(r["cost"]) - theirs) > 1e-3
    print(f"bowl n {n:2d} tolerance {tolerance:g}: ours {float(r['cost']):.9f} in {r['evaluations']} evaluations, "
          f"NLopt {theirs:.9f} in {opt.get_numevals()}")
sys.exit(bool(failed))
