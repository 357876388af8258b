"""Writes a walk as files of NumPy and MATLAB, and runs the recipes that turn them into a table: `recipes.py WALK FOLDER RECIPE…`."""

import os
import sys

import numpy
import pandas
import scipy.io

walk, folder, *recipes = sys.argv[1:]
table = pandas.read_csv(walk)
arrays = {
    "t": table["t"].to_numpy(),
    "acc": table[["ax", "ay", "az"]].to_numpy(),
    "gyr": table[["wx", "wy", "wz"]].to_numpy(),
}
os.chdir(folder)
numpy.savez("walk.npz", **arrays)
scipy.io.savemat("walk.mat", arrays)
numpy.save("walk.npy", table[["t", "ax", "ay", "az", "wx", "wy", "wz"]].to_numpy())
names = {"numpy": numpy, "scipy": scipy, "walk": numpy.load("walk.npy")}
for number, recipe in enumerate(recipes):
    for statement in recipe.split(", then "):
        exec(statement, names)
    os.rename("walk.csv", f"walk{number}.csv")
