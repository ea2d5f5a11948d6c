#!/usr/bin/env python3
"""Makes the reference files beside it from a folder of CONTACT results and method notes; see README.md.

usage: import.py SOURCE    (SOURCE holds domain.md, seed-method.md, seed-method-figures.json and reference/)
"""
import json
import math
import pathlib
import sys

SOURCE = pathlib.Path(sys.argv[1])
TARGET = pathlib.Path(__file__).parent
CLASSES = ["hertz_long", "hertz_lat", "hertz_spin", "hertz_longspin", "hertz_xyspin", "hertz_linear", "carter2d"]
QUANTITIES = [("Fx_rel", "force_x"), ("Fy_rel", "force_y"), ("Mz_rel", "moment_z")]


def write_lines(name, records):
    lines = ",\n".join(json.dumps(r) for r in records)
    (TARGET / name).write_text("[\n" + lines + "\n]\n")


def flipped(value):
    """The force on the lower body; CONTACT gives the one on the upper body. No negative zero."""
    return -value + 0.0


def reference_case(record):
    given = record["input"]
    out = {
        "id": record["id"],
        "class": record["cls"],
        "a_mm": given["hertz"]["a"] if "hertz" in given else record["analytic"]["a"],
        "b_mm": given["hertz"]["b"] if "hertz" in given else None,
        "normal_force_n": given["load"]["FN"],
        "friction": given["mu"],
        "shear_modulus_mpa": given["material"]["G"],
        "poisson_ratio": given["material"]["nu"],
        "creepage_x": given["creepage"]["xi"],
        "creepage_y": given["creepage"]["eta"],
        "spin_per_mm": given["creepage"]["phi"],
    }
    converged = record["converged"]
    for theirs, ours in QUANTITIES:
        out[ours] = {"value": flipped(converged[theirs]["value"]), "unc": converged[theirs]["unc"]}
    if "width_mm" in given:
        out["width_mm"] = given["width_mm"]
        out["pressure_max_mpa"] = record["analytic"]["p0"]
        out["relative_radius_mm"] = record["analytic"]["R_eff"]
        # The analytic value has CONTACT's sign too: xi < 0 gives a positive force on the upper body.
        out["carter_force_x"] = flipped(record["analytic"]["Fx_rel"])
    if "kalker" in record:
        out["kalker"] = record["kalker"]
    out["grids"] = [
        {
            "n": run["n"],
            **{ours: flipped(run[theirs] - converged[theirs]["value"]) for theirs, ours in QUANTITIES},
            "cpu_s": run["cpu_total_s"],
        }
        for run in record["grids"]
        if run["solver"] == "default" and run["eps"] == 1e-6
    ]
    return out


def timing():
    data = json.loads((SOURCE / "reference/timing.json").read_text())
    rows = [
        {"id": row["reference_case"], "solver": row["solver"], "n": row["n"], "cpu_s": row["cpu_total_s"]}
        for row in data["rows"]
        if row.get("reference_case", "").split("_")[0] in ("long", "lat", "spin", "longspin", "xyspin", "carter2d")
        and row["eps"] == 1e-6
    ]
    text = ",\n".join(json.dumps(row) for row in rows)
    head = {"build": data["build"], "cpu": data["cpu"], "threads": data["threads"]}
    (TARGET / "contact_timing.json").write_text(json.dumps(head)[:-1] + ',\n"rows": [\n' + text + "\n]}\n")


def section(text, start, end):
    return text.split(start, 1)[1].split(end, 1)[0]


def table(text):
    """Rows of the first markdown table in a text, without its two head lines."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def kalker():
    text = section((SOURCE / "domain.md").read_text(), "(b) The same table recomputed", "Agreement of (a)")
    out, inverse = [], False
    for row in table(text):
        name = row[0]
        inverse = inverse or name.startswith("b/a")
        ratio = float(name.split("=")[-1])
        for k, nu in enumerate([0.0, 0.25, 0.5]):
            values = [float(cell.replace("*", "").split("/")[k]) for cell in row[1:]]
            out.append({"a_over_b": 1 / ratio if inverse else ratio, "poisson_ratio": nu,
                        **dict(zip(["c11", "c22", "c23", "c33"], values))})
    assert len(out) == 57
    write_lines("kalker.json", out)


def influence(x, y, cell, nu, g):
    """The closed form, to check the numbers copied from the notes."""
    def asinh(u, v):
        return 0.0 if u == 0 else u * (math.copysign(math.inf, v) if u == 0 else math.asinh(v / abs(u)))

    xl, xr, yb, yt = cell
    sums = [0.0, 0.0, 0.0]
    for p, q, sign in [(x - xl, y - yb, 1), (x - xr, y - yb, -1), (x - xl, y - yt, -1), (x - xr, y - yt, 1)]:
        sums[0] += sign * asinh(q, p)
        sums[1] += sign * asinh(p, q)
        sums[2] -= sign * math.hypot(p, q)
    ixx, iyy, ixy = (s / (2 * math.pi * g) for s in sums)
    return [ixx + (1 - nu) * iyy, nu * ixy, (1 - nu) * ixx + iyy]


def kernels():
    text = (SOURCE / "seed-method.md").read_text()
    part = section(text, "Unit-test values", "## 3.")
    # "same" always means the first cell of the table.
    first, points = [-0.5, 0.5, -0.3, 0.3], []
    for row in table(part):
        x, y = (float(v) for v in row[0].split("(")[0].split(","))
        cell = first if row[1] == "same" else [float(v) for v in row[1].split(",")]
        points.append((x, y, cell, 0.25, 0.375, [float(v) for v in row[2:]]))
    assert points[0][2] == first
    for clause in section(part, "At (2,1.5) on the same cell:", ".\n").split(";"):
        nu, g, *values = (float(v.split("=")[-1]) for v in clause.split(":")[0].split(",") + clause.split(":")[1].split(","))
        points.append((2.0, 1.5, first, nu, g, values))
    assert len(points) == 11
    rows = []
    for x, y, cell, nu, g, values in points:
        assert all(abs(a - b) < 2e-12 for a, b in zip(values, influence(x, y, cell, nu, g))), (x, y, values)
        rows.append({"x": x, "y": y, "cell": cell, "poisson_ratio": nu, "shear_modulus": g,
                     **dict(zip(["xx", "xy", "yy"], values))})

    figures = json.loads((SOURCE / "seed-method-figures.json").read_text())
    names = {"ellipse 1": "circle", "ellipse a/b=1/0.3": "long_ellipse", "egg bp=.7 bm=1.4": "egg"}
    solver = [
        {"region": names[r["region"]], "rule": r["rule"], "motion": [r["vx"], r["vy"], r["phi"]],
         "force_x": r["Fx"], "force_y": r["Fy"], "moment_z": r["Mz"],
         **{k: r[k] for k in ("stick_cells", "sum_pA", "dissipation") if k in r}}
        for r in figures["solver_test_values"]
        if r["region"] in names and r["rule"] in ("half", "trapezoid")
        and (r["strips"], r["cells_per_strip"]) == (6, 5)
    ]
    parts = [
        '"influence": [\n' + ",\n".join(json.dumps(r) for r in rows) + "\n]",
        '"solver": [\n' + ",\n".join(json.dumps(r) for r in solver) + "\n]",
    ]
    (TARGET / "kernels.json").write_text("{\n" + ",\n".join(parts) + "\n}\n")


for name in CLASSES:
    records = json.loads((SOURCE / f"reference/{name}.json").read_text())
    write_lines(f"{name}.json", [reference_case(r) for r in records])
timing()
kalker()
kernels()
