#!/usr/bin/env python3
"""Makes the reference files beside it from a folder of CONTACT results and method notes; see README.md.

usage: import.py SOURCE    (SOURCE holds domain.md, seed-method.md, seed-method-figures.json and reference/)
"""
import gzip
import json
import math
import pathlib
import re
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


PRESSED = [("approach_mm", "approach_mm"), ("area_mm2", "area_mm2"), ("pmax_MPa", "pressure_max_mpa")]


def converged_pressed(out, converged):
    """Approach, area and largest pressure, and the resultants (body 2), with their uncertainties."""
    for theirs, ours in PRESSED:
        out[ours] = {key: converged[theirs][key] for key in ("value", "unc")}
    for theirs, ours in [("Fx_N", "force_x_n"), ("Fy_N", "force_y_n"), ("Mz_Nmm", "moment_z_n_mm")]:
        out[ours] = {"value": flipped(converged[theirs]["value"]), "unc": converged[theirs]["unc"]}
    return out


def own_runs(grids, converged, normal_force):
    """Error and CPU seconds of CONTACT's own runs: the largest of those of F_x, F_y over μN and M_z over μN√(A/π)."""
    limit = 0.3 * normal_force
    arm = limit * math.sqrt(converged["area_mm2"]["value"] / math.pi)
    units = {"Fx_N": limit, "Fy_N": limit, "Mz_Nmm": arm}
    return [
        {
            "cells": run["ncon"],
            "error": float(f"{max(abs(run[q] - converged[q]['value']) / unit for q, unit in units.items()):.3g}"),
            "cpu_s": run["cpu_total_s"],
        }
        for run in grids
        if run["solver"] == "default" and run.get("eps", 1e-6) == 1e-6
    ]


def gap_across(geometry):
    """The gap at x = 0 as arcs, as a polynomial, or as the least of several parabolas."""
    if geometry["type"] == "radii_y":
        assert geometry["Rx"] == 460
        return {"arcs": geometry["segments"]}
    expression = geometry["expr"].replace(" ", "")
    assert expression.startswith("x**2/920.0+")
    parabolas = re.findall(r"\(y([+-][\d.]+)\)\*\*2/([\d.]+)(?:\+([\d.]+))?", expression)
    if parabolas:
        # Least of (y − y0)²/d + offset, as [y0, d, offset].
        return {"parabolas": [[-float(y0), float(d), float(offset or 0)] for y0, d, offset in parabolas]}
    square = re.search(r"y\*\*2/([\d.]+)", expression)
    fourth = re.search(r"([\d.e-]+)\*y\*\*4", expression)
    return {"powers": [1 / float(square[1]) if square else 0.0, float(fourth[1])]}


def gap_profiles():
    out = []
    for name in ["nonhertz_radii", "nonhertz_quartic", "nonhertz_two"]:
        for record in json.loads((SOURCE / f"reference/{name}.json").read_text()):
            given = record["input"]
            window = given["window"]
            assert (given["material"]["G"], given["material"]["nu"], given["mu"]) == (82000.0, 0.28, 0.3)
            out.append(converged_pressed({
                "id": record["id"],
                "rolling_mm": 460.0,
                "across": gap_across(given["geometry"]),
                "window_y_mm": [window["yl"], window["yh"]],
                "normal_force_n": given["load"]["FN"],
                "creepage_x": given["creepage"]["xi"],
                "creepage_y": given["creepage"]["eta"],
                "spin_per_mm": given["creepage"]["phi"],
                "contact_runs": own_runs(record["grids"], record["converged"], given["load"]["FN"]),
            }, record["converged"]))
    write_lines("gap_profiles.json", out)


def gap_grids():
    """Undeformed distances of wheel on rail, cut to the box (three cells wider) where they are below 1.3 times the approach."""
    out = []
    for record in json.loads((SOURCE / "reference/profile_module1.json").read_text()):
        given = record["input"]
        assert (given["G"], given["nu"], given["mu"]) == (82000.0, 0.28, 0.3)
        for patch in record["patches"]:
            # With two patches that far apart the program lets them influence each other only in part.
            if "fields_file" not in patch or record["id"] == "prof_y5_10kN_bench":
                continue
            fields = json.loads(gzip.decompress((SOURCE / "reference" / patch["fields_file"]).read_bytes()))
            table = fields["table"]
            mx, my, gap = table["mx"], table["my"], table["cols"]["h"]
            converged = patch["converged"]
            level = 1.3 * converged["approach_mm"]["value"]
            low = [k for k in range(mx * my) if gap[k] < level]
            columns = range(max(min(k % mx for k in low) - 3, 0), min(max(k % mx for k in low) + 4, mx))
            rows = range(max(min(k // mx for k in low) - 3, 0), min(max(k // mx for k in low) + 4, my))
            # Every grid of the program counts the distance from its own least sample, so does the approach.
            converged["approach_mm"]["value"] = fields["approach_mm"]
            out.append(converged_pressed({
                "id": record["id"],
                "x_mm": [round(table["xc1"] + i * table["dx"], 6) for i in columns],
                "y_mm": [round(table["yc1"] + j * table["dy"], 6) for j in rows],
                "gap_mm": [[round(gap[j * mx + i], 7) for i in columns] for j in rows],
                "normal_force_n": converged["Fn_N"]["value"],
                "creepage_x": converged["xi"]["value"],
                "creepage_y": converged["eta"]["value"],
                "spin_per_mm": converged["phi"]["value"],
                "contact_runs": own_runs(patch["grids"], converged, converged["Fn_N"]["value"]),
            }, converged))
    write_lines("gap_grids.json", out)


def usfd_rate(over_area):
    """The wear map in ug/(m mm2), of the friction power over area and speed in N/mm2 (Braghin et al. 2006)."""
    return 5.3 * min(over_area, 10.4) + 61.9 * max(over_area - 77.2, 0.0)


def wear():
    """Friction power over speed and width, and wear depth of the map, of each row of elements: sums of |p| times slip along x.

    `power_n` is the power of the converged forces. Sums over elements fall short of it, by more the smaller the slip.
    """
    powers = {}
    for name in CLASSES[:5]:
        for r in json.loads((TARGET / f"{name}.json").read_text()):
            limit, c = r["friction"] * r["normal_force_n"], math.sqrt(r["a_mm"] * r["b_mm"])
            powers[r["id"]] = limit * (r["force_x"]["value"] * r["creepage_x"] + r["force_y"]["value"] * r["creepage_y"]
                                       + c * r["moment_z"]["value"] * r["spin_per_mm"])
    for r in json.loads((TARGET / "gap_grids.json").read_text()):
        powers[r["id"]] = (r["force_x_n"]["value"] * r["creepage_x"] + r["force_y_n"]["value"] * r["creepage_y"]
                           + r["moment_z_n_mm"]["value"] * r["spin_per_mm"])
    out = []
    for path in sorted((SOURCE / "reference/fields").glob("*.json.gz")):
        fields = json.loads(gzip.decompress(path.read_bytes()))
        if fields["id"] not in powers or fields.get("patch", 0) != 0:
            continue
        if "table" in fields:
            grid, columns = fields["table"], fields["table"]["cols"]
            first = grid["yc1"]
            rows = [k // grid["mx"] for k in range(grid["mx"] * grid["my"])]
        else:
            grid, columns = fields["grid"], fields["columns"]
            first, rows = grid["y_center_first"], columns["iy"]
        power, depth = {}, {}
        for row, px, py, slip in zip(rows, columns["px"], columns["py"], columns["srel"]):
            of_element = math.hypot(px or 0.0, py or 0.0) * (slip or 0.0)
            power[row] = power.get(row, 0.0) + of_element * grid["dx"]
            # In nm, of steel with 7850 kg/m3.
            depth[row] = depth.get(row, 0.0) + usfd_rate(of_element) * grid["dx"] / 7.85
        kept = [row for row in sorted(power) if power[row] > 0.0]
        # Fewer rows do not resolve a patch, and what loses more of its power has too little slip for its elements.
        found = sum(power.values()) * grid["dy"]
        if len(kept) < 20 or abs(found / powers[fields["id"]] - 1.0) > 0.08:
            continue
        out.append({
            "id": fields["id"],
            "power_n": round(powers[fields["id"]], 4),
            "dy_mm": grid["dy"],
            "y_mm": [round(first + row * grid["dy"], 6) for row in kept],
            "power_n_per_mm": [round(power[row], 6) for row in kept],
            "usfd_depth_nm": [round(depth[row], 6) for row in kept],
        })
    write_lines("wear.json", out)


def subsurface():
    """Stresses in the upper body: every fifth point from a depth of 0.01 semi-axes on whose uncertainty is small."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/subsurface.json").read_text()):
        given = record["input"]
        geometry = given["geometry"]
        largest = record["converged"]["pmax_MPa"]["value"]
        points = [p for p in record["points"] if p[10] <= 0.003 * largest][::5]
        records.append({
            "id": record["id"],
            "semi_axes_mm": [given["hertz"]["a"], given["hertz"]["b"]] if "hertz" in given else None,
            "gap": None if "hertz" in given else {"rolling_mm": geometry["Rx"], "segments": geometry["segments"]},
            "normal_force_n": given["load"]["FN"],
            "friction": given["mu"] if given["problem"] == "steady_rolling" else 0.0,
            "shear_modulus_mpa": given["material"]["G"],
            "poisson_ratio": given["material"]["nu"],
            "motion": [given["creepage"][k] for k in ("xi", "eta", "phi")],
            "pressure_max_mpa": largest,
            "points": points,
        })
    write_lines("subsurface.json", records)


def ellipse(record):
    """The contact of a record on an ellipse with one coefficient of friction."""
    given = record["input"]
    return {
        "id": record["id"],
        "semi_axes_mm": [given["hertz"]["a"], given["hertz"]["b"]],
        "normal_force_n": given["load"]["FN"],
        "friction": given["mu"],
        "shear_modulus_mpa": given["material"]["G"],
        "poisson_ratio": given["material"]["nu"],
    }


def temperature():
    records = []
    for record in json.loads((SOURCE / "reference/extended/temperature.json").read_text()):
        given, thermal = record["input"], record["input"]["thermal"]
        found = record["quadrature"]["converged"]["Tmax"]
        records.append(ellipse(record) | {
            "motion": [given["creepage"][k] for k in ("xi", "eta", "phi")],
            "speed_mm_per_s": given["V_mm_per_s"],
            "conductivity_w_per_mk": 1000 * thermal["lambda_W_per_mmC"],
            "density_kg_per_m3": 1e9 * thermal["density_kg_per_mm3"],
            "specific_heat_j_per_kgk": thermal["heatcp_J_per_kgC"],
            "bulk_upper_c": thermal["body1"]["T"],
            "bulk_lower_c": thermal["body2"]["T"],
            "max_c": {"value": found["value"], "unc": found["unc"]},
        })
    write_lines("temperature.json", records)


def friction_point(creepage, converged, arm):
    """Motion, and forces on the lower body over the normal force (moment: over that and √(ab))."""
    forces = [{"value": flipped(converged[q]["value"]), "unc": converged[q]["unc"]} for q in ("Fx_FN", "Fy_FN")]
    for name, unit in [("Mz_FNc", 1.0), ("Mz_Nmm", arm)]:
        if name in converged:
            forces.append({"value": flipped(converged[name]["value"] / unit), "unc": converged[name]["unc"] / unit})
    return {"motion": creepage, "forces": forces}


def friction():
    """Friction that falls with slip or varies across, and layers, in the words of a case."""
    records = []

    def add(record, words, points, speed=None):
        given = record["input"]
        records.append({
            "id": record["id"],
            "semi_axes_mm": [given["hertz"]["a"], given["hertz"]["b"]],
            "normal_force_n": given["load"]["FN"],
            "shear_modulus_mpa": given["material"]["G"],
            "poisson_ratio": given["material"]["nu"],
            "friction": words,
            "speed_mm_per_s": speed,
            "points": points,
        })

    def load(name):
        for record in json.loads((SOURCE / f"reference/extended/{name}.json").read_text()):
            given = record["input"]
            yield record, given, given["load"]["FN"] * math.sqrt(given["hertz"]["a"] * given["hertz"]["b"])

    laws = {"exp": "exponential", "pol": "exponential", "rat": "rational", "lin": "linear"}
    for record, given, arm in load("falling"):
        f = given["friction"]["f"]
        terms = [{"coefficient": f[k], "half_speed_mm_per_s": f[k + 1]} for k in (1, 3) if f[k]]
        words = {"law": laws[given["friction"]["law"][:3]], "limit": f[0], "terms": terms}
        points = [friction_point([p["xi"], given["eta"], given["phi"]], p["converged"], arm) for p in record["curve"]]
        add(record, words, points, given["V_mm_per_s"])
    for record, given, arm in load("friction_y"):
        b, formula = given["hertz"]["b"], given["friction"]["formula"]
        if "for y<0" in formula:
            y, mu = [-b, 0.0, 0.0, b], [0.2, 0.2, 0.4, 0.4]
        else:
            y = [b * k / 20 for k in range(-20, 21)]
            mu = [eval(formula.split("=")[1].split("(sampled")[0].replace("^", "**"), {"y": at, "b": b}) for at in y]
        words = {"across": {"y_mm": y, "coefficient": [round(value, 12) for value in mu]}}
        creepage = [given["creepage"][k] for k in ("xi", "eta", "phi")]
        add(record, words, [friction_point(creepage, record["converged"], arm)])
    for record, given, arm in load("layer"):
        layer = given["layer"]
        words = {"coefficient": given["mu"],
                 "layer": {"shear_modulus_mpa": layer["G3_MPa"], "thickness_mm": layer["thickness_mm"]}}
        # The layer named pl_200 never reaches its stress; the other plastic one does.
        if layer["kind"] != "elastic":
            words["layer"].update({"yield_mpa": layer["tau_c0_MPa"], "hardening_mpa_per_mm": layer["k_tau"]})
        over_load = {theirs.replace("rel", ours): {k: given["mu"] * record["converged"][theirs][k] for k in ("value", "unc")}
                     for theirs, ours in [("Fx_rel", "FN"), ("Fy_rel", "FN"), ("Mz_rel", "FNc")]}
        creepage = [given["creepage"][k] for k in ("xi", "eta", "phi")]
        add(record, words, [friction_point(creepage, over_load, arm)])
    write_lines("friction.json", records)


def unlike():
    """Steady rolling of bodies that differ, three-dimensional."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/dissimilar.json").read_text()):
        if not record["id"].startswith("dis_"):
            continue
        given, converged = record["input"], record["converged"]
        body = lambda k: {"shear_modulus_mpa": given["material"][f"G{k}"], "poisson_ratio": given["material"][f"nu{k}"]}
        records.append({
            "id": record["id"],
            "material": {"upper": body(1), "lower": body(2)},
            "difference": given["material"]["K"],
            "radii_mm": [0.5 / given["geometry"]["A"], 0.5 / given["geometry"]["B"]],
            "normal_force_n": given["load"]["FN"],
            "friction": given["mu"],
            "motion": [given["creepage"][k] for k in ("xi", "eta", "phi")],
            "forces": [{"value": flipped(converged[q]["value"]), "unc": converged[q]["unc"]} for q in ("Fx_rel", "Fy_rel", "Mz_rel")],
            "arm_mm": math.sqrt(given["hertz_K0"]["a"] * given["hertz_K0"]["b"]),
            **{ours: {k: converged[theirs][k] for k in ("value", "unc")} for theirs, ours in PRESSED},
        })
    write_lines("unlike.json", records)


def pressing():
    """Bodies that differ pressed together under friction, without rolling (Spence)."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/dissimilar.json").read_text()):
        if not record["id"].startswith("spence_"):
            continue
        given, converged = record["input"], record["converged"]
        body = lambda k: {"shear_modulus_mpa": given["material"][f"G{k}"], "poisson_ratio": given["material"][f"nu{k}"]}
        names = [("approach_mm", "approach_mm"), ("pmax_MPa", "pressure_max_mpa"), ("stick_radius_ratio", "stick_radius"), ("ptmax_MPa", "traction_max_mpa")]
        records.append({
            "id": record["id"],
            "material": {"upper": body(1), "lower": body(2)},
            "radius_mm": 0.5 / given["geometry"]["A"],
            "normal_force_n": given["load"]["FN"],
            "friction": given["mu"],
            **{ours: {k: converged[theirs][k] for k in ("value", "unc")} for theirs, ours in names},
        })
    write_lines("pressing.json", records)


def cylinders():
    """Steady rolling of unlike cylinders: the creepage that belongs to a force (lower body) over the friction limit."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/dissimilar.json").read_text()):
        if not record["id"].startswith("bj2d_"):
            continue
        given, creepage = record["input"], record["converged"]["xi"]
        pair, shape = given["material"], given["geometry"]
        body = lambda k: {"shear_modulus_mpa": pair[f"G{k}"], "poisson_ratio": pair[f"nu{k}"]}
        records.append({
            "id": record["id"],
            "material": {"upper": body(1), "lower": body(2)},
            "shear_modulus_mpa": pair["G_comb"],
            "difference": pair["K"],
            "half_length_mm": shape["half_width_a"],
            "force_n_per_mm": given["load"]["FN"] / shape["width_mm"],
            "friction": given["mu"],
            "force": flipped(given["load"]["FXrel"]),
            "creepage": {k: creepage[k] for k in ("value", "unc")},
        })
    write_lines("cylinders.json", records)


def transient():
    """Rolling that changes: forces over the friction limit (lower body) and creepages, each with its uncertainty, in the distance rolled."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/transient.json").read_text()):
        given = record["input"]
        force, creepage = given["load"].get("FXrel"), given["creepage"] or {}
        finest = record["grids"][-1]["history"][0]
        signs = {"distance_mm": 1.0, "Fx_rel": -1.0, "Fy_rel": -1.0, "Mz_rel": -1.0, "xi": 1.0}
        columns = record["converged_history"]["columns"]
        table = [dict(zip(columns, row)) for row in record["converged_history"]["rows"]]
        rows = [[signs[name] * row[name] + 0.0 for name in signs] + [row["unc_" + k] for k in ("Fx", "Fy", "Mz", "xi")] for row in table]
        records.append(ellipse(record) | {
            "motion": [creepage.get(k, 0.0) for k in ("xi", "eta", "phi")],
            "force_x": -force if force else None,
            "shift_mm": finest[4] if force else None,
            "rows": rows,
        })
    write_lines("transient.json", records)


def prescribed_forces():
    """Steady rolling with prescribed forces over the friction limit (lower body): creepages and the moment that go with them."""
    records = []
    for record in json.loads((SOURCE / "reference/extended/force_prescribed.json").read_text()):
        given, converged = record["input"], record["converged"]
        found = lambda k, sign: {"value": sign * converged[k]["value"] + 0.0, "unc": converged[k]["unc"]}
        records.append(ellipse(record) | {
            "forces": [flipped(given["load"][k]) for k in ("FXrel", "FYrel")],
            "spin_per_mm": given["creepage"]["phi"],
            "creepages": [found("xi", 1.0), found("eta", 1.0)],
            "moment": found("Mz_rel", -1.0),
        })
    write_lines("prescribed_forces.json", records)


for name in CLASSES:
    records = json.loads((SOURCE / f"reference/{name}.json").read_text())
    write_lines(f"{name}.json", [reference_case(r) for r in records])
timing()
kalker()
kernels()
gap_profiles()
gap_grids()
subsurface()
temperature()
friction()
unlike()
pressing()
cylinders()
transient()
prescribed_forces()
wear()
