"""The page of a night: index.html, and its tables as CSV, from the runs of a folder of the fleet's workflow.

    night.py FOLDER

drives.csv: one row a drive and setting, the worst first. places.csv: the places where LiDAR was degenerate, where
estimates were lost, and where the magnetic map is stale, over all drives, the worst first.
"""

import functools
import html
import json
import math
import sys
from pathlib import Path

import pandas as pd

CELL_M = 5.0  # places are the cells of this grid, of which each drive counts once
SHOWN = 20    # rows of a table on the page; the CSV files have all
OUTCOMES = ("refused", "lost", "regained", "uncertain", "done")
COLUMNS = ["drive", "setting", "estimator", "outcome", "duration_s", "lost_s", "uncertain_s", "degenerate_s",
           "stale_places", "warnings", "times_real_time", "message"]


def read(path: Path) -> dict:
    return json.loads(path.read_text())


@functools.lru_cache(maxsize=8)
def scans_of(run: Path) -> pd.DataFrame:
    """Time and health of each scan, its position, and the number of its stretch of scans with a pose."""
    diagnostics = pd.read_csv(run / "diagnostics.csv", usecols=["t_s", "health", "degenerate_directions"])
    poses = pd.read_csv(run / "trajectory.tum", sep=" ", comment="#", header=None, usecols=[0, 1, 2],
                        names=["t_s", "x_m", "y_m"])
    scans = diagnostics.merge(poses, on="t_s", how="left")
    scans["step_s"] = scans["t_s"].diff().fillna(0.0).clip(upper=1.0)
    scans["degenerate"] = (scans["degenerate_directions"] > 0) & (scans["health"] != "lost")
    scans["stretch"] = (scans["x_m"].isna() != scans["x_m"].isna().shift()).cumsum().where(scans["x_m"].notna())
    # A lost scan has no pose: it counts at the last one before.
    scans[["x_m", "y_m"]] = scans[["x_m", "y_m"]].ffill()
    return scans


def drive_row(drive: str, setting: str, note: dict, check: dict, runs: list) -> list:
    base = {"drive": drive, "setting": setting}
    if note["code"] == 2:
        return [base | {"estimator": "", "outcome": "refused", "message": note["message"]}]
    rows = []
    for run in runs:
        summary = read(run / "summary.json")
        scans = scans_of(run)
        lost_s = float(scans.loc[scans["health"] == "lost", "step_s"].sum())
        uncertain_s = float(scans.loc[scans["health"] == "uncertain", "step_s"].sum())
        status = summary["status"]
        outcome = ("lost" if status == "lost" else "regained" if lost_s > 0 or status != "done"
                   else "uncertain" if uncertain_s > 0 else "done")
        rows.append(base | {
            "estimator": summary["estimator"], "outcome": outcome, "duration_s": round(summary["duration_s"], 1),
            "lost_s": round(lost_s, 1), "uncertain_s": round(uncertain_s, 1),
            "degenerate_s": round(float(scans.loc[scans["degenerate"], "step_s"].sum()), 1),
            "stale_places": summary.get("stale_map", {}).get("stale_places", 0),
            "warnings": sum(each["count"] for each in summary["warnings"].values()),
            "times_real_time": round(summary["real_time_factor"], 2),
            "message": "lodestone check finds errors" if check["code"] == 2 else ""})
    return rows


def places_of(drive: str, run: Path) -> pd.DataFrame:
    """Seconds of degenerate and lost scans in each cell, and the largest difference of stale places there."""
    scans = scans_of(run).dropna(subset=["x_m"])
    parts = []
    for kind, chosen in (("degenerate", scans["degenerate"]), ("lost", scans["health"] == "lost"),
                         ("passed", scans["health"] == "good")):
        parts.append(scans.loc[chosen, ["x_m", "y_m", "step_s"]].rename(columns={"step_s": "amount"}).assign(kind=kind))
    stale_file = run / "stale_places.csv"
    if stale_file.exists():
        stale = pd.read_csv(stale_file)[["x_m", "y_m", "largest_difference_ut"]]
        parts.append(stale.rename(columns={"largest_difference_ut": "amount"}).assign(kind="stale"))
    cells = pd.concat(parts, ignore_index=True)
    for axis in ("x_m", "y_m"):
        cells[axis] = (cells[axis] // CELL_M + 0.5) * CELL_M
    grouped = cells.groupby(["kind", "x_m", "y_m"], as_index=False)["amount"]
    summed = grouped.sum()
    largest = grouped.max()
    summed.loc[summed["kind"] == "stale", "amount"] = largest.loc[largest["kind"] == "stale", "amount"]
    return summed.assign(drive=drive)


def ranked_places(cells: pd.DataFrame) -> pd.DataFrame:
    """Over all drives: how many saw the place so, of how many that passed it, and the sum of seconds (stale: µT)."""
    columns = ["kind", "x_m", "y_m", "drives", "drives_there", "seconds", "difference_ut"]
    if cells.empty:
        return pd.DataFrame(columns=columns)
    there = cells.groupby(["x_m", "y_m"])["drive"].nunique().rename("drives_there").reset_index()
    result = cells[cells["kind"] != "passed"].groupby(["kind", "x_m", "y_m"], as_index=False).agg(
        drives=("drive", "nunique"), total=("amount", "sum"), largest=("amount", "max"))
    result = result.merge(there, on=["x_m", "y_m"])
    stale = result["kind"] == "stale"
    result["seconds"] = result["total"].where(~stale).round(1)
    result["difference_ut"] = result["largest"].where(stale).round(1)
    return result.sort_values(["kind", "drives", "total"], ascending=[True, False, False])[columns]


def round_length(at_most_m: float) -> float:
    """The largest of 1, 2, 5, 10, … metres (or their tenths, hundredths …) up to a length."""
    power = 10.0 ** math.floor(math.log10(at_most_m))
    return max(factor * power for factor in (1, 2, 5) if factor * power <= at_most_m)


def scale_bar(left: float, bottom: float, width: float, letter: float) -> str:
    """A bar of a round length with its text, as SVG in metres."""
    length = round_length(0.3 * width)
    return (f'<path class="scale" stroke-width="{letter / 8:.2f}" d="M{left:.2f},{bottom - letter / 2:.2f} '
            f'v{letter / 2:.2f} h{length:g} v{-letter / 2:.2f}"/>'
            f'<text x="{left + length + letter / 2:.2f}" y="{bottom:.2f}" font-size="{letter:.2f}">{length:g} m</text>')


def picture(tracks: list, places: pd.DataFrame) -> str:
    """All drives from above, with the places, as SVG."""
    points = pd.concat(tracks, ignore_index=True).dropna() if tracks else pd.DataFrame()
    if points.empty:
        return ""
    left, top = points["x_m"].min() - CELL_M, -points["y_m"].max() - CELL_M
    width, height = points["x_m"].max() - left + CELL_M, -points["y_m"].min() - top + CELL_M
    line = max(width, height) / 600.0
    letter = 12.0 * line
    width, height = max(width, 10.0 * letter), height + 2.0 * letter  # the scale bar is below the drives
    parts = [f'<svg viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" role="img" '
             f'aria-label="All drives from above">']
    for kind in ("degenerate", "stale", "lost"):
        for place in places[places["kind"] == kind].itertuples():
            share = place.drives / place.drives_there
            parts.append(f'<rect class="{kind}" x="{place.x_m - CELL_M / 2:.1f}" y="{-place.y_m - CELL_M / 2:.1f}" '
                         f'width="{CELL_M}" height="{CELL_M}" opacity="{0.2 + 0.6 * share:.2f}"/>')
    for track in tracks:
        for _, stretch in track.groupby("stretch"):
            drawn = pd.concat([stretch.iloc[::5], stretch.iloc[-1:]])
            path = " ".join(f"{x:.1f},{-y:.1f}" for x, y in zip(drawn["x_m"], drawn["y_m"]))
            parts.append(f'<polyline points="{path}" stroke-width="{line:.2f}"/>')
    parts.append(scale_bar(left + letter, top + height - letter / 2, width, letter))
    return "\n".join(parts + ["</svg>"])


def table(frame: pd.DataFrame, links: dict) -> str:
    """The first rows as HTML. `links`: what a row's drive and setting link to."""
    head = "".join(f"<th>{html.escape(column.replace('_', ' '))}</th>" for column in frame.columns)
    rows = []
    for row in frame.head(SHOWN).to_dict("records"):
        cells = []
        for column, value in row.items():
            text = "" if pd.isna(value) else html.escape(f"{value:g}" if isinstance(value, float) else str(value))
            target = links.get((row.get("drive"), row.get("setting"))) if column == "drive" else None
            cells.append(f'<td><a href="{html.escape(target)}">{text}</a></td>' if target else f"<td>{text}</td>")
        rows.append(f'<tr class="{html.escape(str(row.get("outcome", "")))}">{"".join(cells)}</tr>')
    more = f"<p>{len(frame) - SHOWN} more rows are in the CSV file.</p>" if len(frame) > SHOWN else ""
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>{more}"


STYLE = """body{font:15px/1.5 sans-serif;margin:2em auto;max-width:85em;padding:0 1em;color:#222}
table{border-collapse:collapse;display:block;overflow-x:auto;margin:1em 0;font-variant-numeric:tabular-nums}
th,td{padding:.2em .6em;text-align:left;vertical-align:top}
th{border-bottom:2px solid #888;font-weight:600}tr:nth-child(even){background:#f5f5f5}
tr.refused td:nth-child(4),tr.lost td:nth-child(4){color:#b00020;font-weight:600}
tr.regained td:nth-child(4),tr.uncertain td:nth-child(4){color:#8a5a00;font-weight:600}
svg{width:100%;max-height:38em;background:#fafafa;border:1px solid #ddd}polyline{fill:none;stroke:#555}
.scale{fill:none;stroke:#222}
.degenerate{fill:#e69f00}.stale{fill:#7b3294}.lost{fill:#d7191c}"""

KINDS = {
    "lost": ("Where estimates were lost", "Each lost scan counts at the last place with a pose."),
    "degenerate": ("Where LiDAR was degenerate", "Seconds with a direction that LiDAR did not observe."),
    "stale": ("Where the magnetic map is stale", "Readings differ from the map by more than chance allows. A place "
              "that several drives report has changed; one drive alone may have passed a vehicle."),
}


def page(drives: pd.DataFrame, places: pd.DataFrame, tracks: list, links: dict) -> str:
    counts = drives["outcome"].value_counts()
    said = ", ".join(f"{counts[outcome]} {outcome}" for outcome in OUTCOMES if outcome in counts)
    parts = [f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Night</title><style>{STYLE}</style>',
             f"<h1>{drives['drive'].nunique()} drives</h1><p>{said}. The worst first; all rows: "
             '<a href="drives.csv">drives.csv</a>, <a href="places.csv">places.csv</a>.</p>', table(drives, links)]
    image = picture(tracks, places)
    if image:
        parts.append("<h2>From above</h2><p>Orange: LiDAR degenerate. Purple: magnetic map stale. Red: lost. "
                     f"The darker, the more of the drives that passed.</p>{image}")
    for kind, (title, note) in KINDS.items():
        chosen = places[places["kind"] == kind].drop(columns="kind").dropna(axis=1, how="all")
        if not chosen.empty:
            parts.append(f"<h2>{title}</h2><p>{note} Cells of {CELL_M:g} m.</p>{table(chosen, {})}")
    return "\n".join(parts) + "\n"


def make(folder: Path) -> None:
    rows, cells, tracks, links = [], [], [], {}
    for note_file in sorted(folder.glob("drives/*/*.run.json")):
        drive, setting = note_file.parent.name, note_file.name.removesuffix(".run.json")
        note, check = read(note_file), read(note_file.parent / "check.json")
        runs = sorted(path.parent for path in (note_file.parent / setting).glob("*/summary.json"))
        rows += drive_row(drive, setting, note, check, runs)
        if (note_file.parent / setting / "report.html").exists():
            links[drive, setting] = f"drives/{drive}/{setting}/report.html"
        # Settings of one drive see the same places: the first one counts.
        if note["code"] != 2 and runs and not any(track.attrs["drive"] == drive for track in tracks):
            cells.append(places_of(drive, runs[0]))
            tracks.append(scans_of(runs[0])[["x_m", "y_m", "stretch"]])
            tracks[-1].attrs["drive"] = drive
    drives = pd.DataFrame(rows, columns=COLUMNS)
    drives["rank"] = drives["outcome"].map(OUTCOMES.index)
    drives = drives.sort_values(["rank", "lost_s", "drive", "setting"], ascending=[True, False, True, True])
    drives = drives.drop(columns="rank")
    places = ranked_places(pd.concat(cells, ignore_index=True) if cells else pd.DataFrame())
    drives.to_csv(folder / "drives.csv", index=False)
    places.to_csv(folder / "places.csv", index=False)
    (folder / "index.html").write_text(page(drives, places, tracks, links))


if __name__ == "__main__":
    make(Path(sys.argv[1]))
