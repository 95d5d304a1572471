"""Loads what a run has written with the readers that other people use, and compares what they find.

    check.py RUN [RUN …]        folders of results with every file for other tools in them

Each file is loaded by its reader in one line, and what it gives is compared with `summary.json`, with another file of the same run or
with a closed form; nothing of the program's own code is used.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import meshio
import morphio
import navis
import neurom
import numpy as np
import pandas
import polars
import pyvista

navis.config.pbar_hide = True
morphio.set_maximum_warnings(0)
CHECKS = 0


def demand(holds, what):
    global CHECKS
    CHECKS += 1
    if not holds:
        sys.exit(f"FAILED: {what}")


def near(found, expected, tolerance, what):
    worst = np.max(np.abs(np.asarray(found, float) - np.asarray(expected, float)), initial=0.0)
    demand(worst <= tolerance, f"{what}: {found} instead of {expected}, tolerance {tolerance}")


def morphio_length(path):
    morphology = morphio.Morphology(path)
    return sum(np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum() for s in morphology.sections)


def check_swc(run, summary):
    """Each axon has the same length with every reader, and together that of the summary. Points are 32 bit numbers in MorphIO."""
    files = sorted((run / "swc").glob("*.swc"))
    demand(len(files) > 3, f"{run} has {len(files)} SWC files")
    table = polars.read_parquet(run / "axons.parquet").filter(polars.col("time [h]") == summary["time"])
    stated = dict(table.group_by("root").agg(polars.col("length [um]").sum()).rows())
    total = 0.0
    for path in files:
        rows = np.loadtxt(path, ndmin=2)
        ids, parents = rows[:, 0], rows[:, 6]
        demand(len(rows) > 1 and np.array_equal(ids, np.arange(1, len(rows) + 1)), f"{path}: ids run from 1")
        demand(parents[0] == -1 and np.all(parents[1:] < ids[1:]) and np.all(parents[1:] >= 1), f"{path}: parents")
        demand(np.all(rows[:, 1] == 2) and np.all(rows[:, 4] == 0) and np.all(rows[:, 5] > 0), f"{path}: type, z, radius")
        length = stated[int(path.stem.split("_")[1])]
        rounding = 1e-6 * (length + 1000.0)
        near(np.linalg.norm(rows[1:, 2:5] - rows[parents[1:].astype(int) - 1, 2:5], axis=1).sum(), length, 1e-8, f"{path}")
        near(morphio_length(path), length, rounding, f"{path} with MorphIO")
        near(neurom.get("total_length", neurom.load_morphology(path)), length, rounding, f"{path} with NeuroM")
        total += length
    lengths = summary["morphology"]["length_um"]
    near(total, lengths["n"] * lengths["mean"], 1e-8 * total, f"{run}: all lengths")
    population = neurom.load_morphologies(run / "swc")
    near(sum(neurom.get("total_length", m) for m in population), total, 1e-5 * total, f"{run} as a population of NeuroM")
    neurons = navis.read_swc(str(run / "swc"))
    near(neurons.cable_length.sum(), total, 1e-5 * total, f"{run} with navis")
    alone = [note for note in summary["notes"] if note.startswith("swc: ")]
    demand(len(files) + sum(int(note.split("; ")[1].split()[0]) for note in alone) == len(stated), f"{run}: {alone}")
    return len(files), total


def check_archive(run, total):
    with zipfile.ZipFile(run / "swc.zip") as archive:
        demand(archive.testzip() is None, f"{run}/swc.zip")
    neurons = navis.read_swc(str(run / "swc.zip"))
    near(neurons.cable_length.sum(), total, 1e-5 * total, f"{run}/swc.zip with navis")


def series(run, name):
    """Times, and each file as meshio and as pyvista give it."""
    pvd = ElementTree.parse(run / f"vtu/{name}.pvd").findall(".//DataSet")
    reader = pyvista.get_reader(run / f"vtu/{name}.pvd")
    times = [float(entry.get("timestep")) for entry in pvd]
    near(reader.time_values, times, 0.0, f"{run}: times of {name}")
    files = [run / "vtu" / entry.get("file") for entry in pvd]
    return [(time, meshio.read(file), pyvista.read(file)) for time, file in zip(times, files) if is_filled(file)]


def is_filled(file):
    """Before the first birth there is no shaft; a grid without a point is no mesh to these readers."""
    return 'NumberOfPoints="0"' not in file.read_text()[:500]


def same(one, other, what):
    near(one.points, other.points, 0.0, f"{what}: points")
    for name, values in one.point_data.items():
        near(values.ravel(), other.point_data[name].ravel(), 0.0, f"{what}: {name}")
    for name, blocks in one.cell_data.items():
        near(np.concatenate(blocks).ravel(), other.cell_data[name].ravel(), 0.0, f"{what}: {name}")


def areas(points, triangles):
    a, b, c = (points[triangles[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def check_vtu(run, scene):
    tissue, fields, shafts = (series(run, name) for name in ("tissue", "fields", "shafts"))
    demand(len(tissue) > 2 and len(fields) > 1 and len(shafts) > 2, f"{run}: {len(tissue)}, {len(fields)}, {len(shafts)} files")
    for name, frames in (("tissue", tissue), ("fields", fields), ("shafts", shafts)):
        for time, one, other in frames:
            same(one, other, f"{run}: {name} at {time} h")
    _, rest, _ = tissue[0]
    triangles = rest.cells_dict["triangle"]
    for time, mesh, _ in tissue:
        moved = mesh.points - mesh.point_data["displacement [um]"]
        near(moved, rest.points, 1e-6, f"{run}: displacement at {time} h")
        ratio = mesh.cell_data_dict["area ratio"]["triangle"].ravel()
        near(ratio * areas(rest.points, triangles), areas(mesh.points, triangles), 1e-6, f"{run}: area at {time} h")
    height = scene["tissue"]["outline"]["rectangle"]["height"]
    outward = {edge: motion["outward"] for edge, motion in scene.get("matrix", {}).get("motion", {}).items()}
    ends = [-outward.get("bottom", 0.0) * height, (1.0 + outward.get("top", 0.0)) * height]
    end = tissue[-1][1].points[:, 1]
    near([end.min(), end.max()], ends, 1e-6, f"{run}: edges at full load")
    check_fields(run, scene, rest, fields)
    trajectories, axons = polars.read_csv(run / "trajectories.csv"), polars.read_parquet(run / "axons.parquet")
    for time, mesh, _ in shafts:
        axon, lines = mesh.point_data["axon"].ravel(), mesh.cells_dict["line"]
        last = np.append(np.flatnonzero(np.diff(axon)), len(axon) - 1)
        tips = trajectories.filter(polars.col("time [h]") == time).sort("axon")
        demand(np.array_equal(axon[last], tips["axon"]), f"{run}: axons at {time} h")
        near(mesh.points[last, :2], tips.select("x [um]", "y [um]").to_numpy(), 1e-6, f"{run}: tips at {time} h")
        length = np.linalg.norm(np.diff(mesh.points[lines], axis=1), axis=2).sum()
        stated = axons.filter(polars.col("time [h]") == time)["length [um]"].sum()
        near(length, stated, 1e-6, f"{run}: length of the shafts at {time} h")
        demand(np.all(mesh.point_data["time [h]"] <= time + 1e-5), f"{run}: times of shafts at {time} h")


def check_fields(run, scene, rest, fields):
    """What is released is degraded: k∫c = q Σ A, in the tissue at rest; sources are polygons of nearly their area."""
    _, mesh, _ = fields[0]
    triangles = mesh.cells_dict["triangle"]
    for name, cue in scene["cues"].items():
        values = mesh.point_data[f"{name} [nM]"].ravel()
        integral = (areas(rest.points, triangles) * values[triangles].mean(axis=1)).sum()
        area = sum(np.pi * source["disc"]["radius"] ** 2 for source in cue["sources"])
        near(integral / (50.0 * area), 1.0, 0.03, f"{run}: what is there of {name}")


def check_tables(run, summary):
    text = polars.read_csv(run / "trajectories.csv")
    columns = polars.read_parquet(run / "trajectories.parquet")
    demand(text.equals(columns), f"{run}: trajectories in both forms")
    demand(pandas.read_csv(run / "trajectories.csv").equals(pandas.read_parquet(run / "trajectories.parquet")), f"{run}: trajectories with pandas")
    for name in ("measures", "axons"):
        text, columns = polars.read_csv(run / f"{name}.csv", infer_schema_length=None), pandas.read_parquet(run / f"{name}.parquet")
        demand(list(text.columns) == list(columns.columns) and len(text) == len(columns), f"{run}: {name}")
        for column in text.columns:
            if text[column].dtype.is_numeric():
                found = columns[column].to_numpy(float, na_value=np.nan)
                demand(np.array_equal(found, text[column].cast(float).fill_null(np.nan).to_numpy(), equal_nan=True), f"{run}: {name}.{column}")
    last = polars.read_parquet(run / "measures.parquet").row(-1, named=True)
    near(last["time [h]"], summary["time"], 0.0, f"{run}: last time")
    near(last["length_um.mean"], summary["morphology"]["length_um"]["mean"], 0.0, f"{run}: mean length")
    near(last["counts.arrived"], summary["counts"]["arrived"], 0.0, f"{run}: arrived")


def main():
    for run in map(Path, sys.argv[1:]):
        summary = json.loads((run / "summary.json").read_text())
        scene = json.loads((run / "manifest.json").read_text())["scenario"]
        check_tables(run, summary)
        count, total = check_swc(run, summary)
        check_vtu(run, scene)
        if (run / "swc.zip").exists():
            check_archive(run, total)
        print(f"{run.name}: {count} trees of {total:.1f} um, and every table and grid, agree with their readers")
    print(f"{CHECKS} comparisons")


if __name__ == "__main__":
    main()
