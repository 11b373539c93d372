"""Fig. 5: average ROC curves of every task, with the tracked demonstrations on them."""

from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.safe_files import written_beside

_COLORS = {"full": "#c2185b", "partial": "#1565c0"}


def draw_roc(report: dict[str, Any], path: Path) -> None:
    """Draw one panel per task and the areas as bars, as Fig. 5 does.

    Args:
        report: of `evaluation_report`; `demonstrations` in a task's entry, as
            `demonstration_figures` gives it, is the red triangle at p = 0.5 with 95 % intervals.
        path: picture to write.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    tasks = list(report["tasks"])
    figure = Figure(figsize=(3.2 * (len(tasks) + 1), 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(tasks) + 1)
    for axis, task in zip(axes, tasks, strict=False):
        own = report["tasks"][task]
        for mask, color in _COLORS.items():
            if mask not in own["roc"]:
                continue
            curve = own["roc"][mask]
            false, true, deviation = (
                np.array(curve[name])
                for name in ("false_positive_rate", "true_positive_rate", "sd")
            )
            low = np.clip(true - 2 * deviation, 0, 1)
            high = np.clip(true + 2 * deviation, 0, 1)
            axis.fill_between(false, low, high, color=color, alpha=0.18, lw=0)
            area = own["auc"][mask]["mean"]
            axis.plot(false, true, color=color, label=f"{mask}, AUC {area:.3f}")
        if own.get("demonstrations"):
            point = own["demonstrations"]
            rates = point["false_positive_rate"], point["true_positive_rate"]
            spread = [
                [[rate - ci[0]], [ci[1] - rate]]
                for rate, ci in zip(
                    rates, (point["false_positive_ci"], point["true_positive_ci"]), strict=True
                )
            ]
            axis.errorbar(
                [rates[0]], [rates[1]], yerr=spread[1], xerr=spread[0], fmt="r^", ms=8, lw=1.0,
                capsize=2, zorder=4, label=f"tracked, partial, AUC {point['auc']:.3f}",
            )  # fmt: skip
        axis.plot([0, 1], [0, 1], color="0.7", lw=0.8, ls="--")
        axis.set(title=task, xlabel="false positive rate", ylabel="true positive rate")
        axis.set_aspect("equal")
        axis.legend(fontsize=7, loc="lower right")
    bars = axes[-1]
    place = np.arange(len(tasks))
    for shift, (mask, color) in zip((-0.2, 0.2), _COLORS.items(), strict=True):
        values = [report["tasks"][t]["auc"].get(mask, {}) for t in tasks]
        means = [v.get("mean", np.nan) for v in values]
        spread = [2 * v.get("sd", np.nan) for v in values]
        bars.bar(place + shift, means, 0.38, yerr=spread, color=color, alpha=0.8, label=mask)
    bars.axhline(0.8, color="0.4", lw=0.8, ls=":", label="the paper: above 0.80")
    bars.set_xticks(place, tasks, rotation=20, fontsize=8)
    bars.set(ylim=(0.5, 1.0), title="AUC")
    bars.legend(fontsize=7, loc="lower right")
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_beside(path) as part:
        figure.savefig(part, dpi=110)
