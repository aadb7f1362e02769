"""The figures of one replay, as lines for a terminal."""

from __future__ import annotations

from typing import Any, Dict, List, Optional

from glass_nav.evaluation.metrics.case_scores import NEAR_M
from glass_nav.evaluation.metrics.integrity_scores import CONSISTENT_NEES
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.vocabulary import CASES_IN_ORDER


def run_lines(result: ReplayResult) -> List[str]:
    """The figures of a run for people."""
    figures = result.metrics()
    lines = [
        f"{figures['scans']} scans, {figures['updates']} updates, {figures['scans_refused']} rejected; "
        f"{figures['cpu_ms_per_scan']:.1f} ms CPU per scan, {figures['times_real_time']:.1f} times real time"
    ]
    if figures["position_mean_m"] is not None or result.errors.matched.any():
        lines.append(
            "position error  "
            + "  ".join(
                f"{name} {_metres(figures[f'position_{name}_m'])}" for name in ("mean", "median", "rmse", "p95", "max")
            )
        )
        lines.append(
            f"yaw error       mean {figures['yaw_mean_deg']:.2f} deg  "
            f"median {figures['yaw_median_deg']:.2f} deg  p95 {figures['yaw_p95_deg']:.2f} deg"
        )
        lines += _relative_lines(figures)
        lines.append(
            f"lost            {100 * figures['lost_share']:.1f} % of the scans more than 0.5 m off, "
            f"{100 * figures['lost_1m_share']:.1f} % more than 1 m"
        )
    lines += _integrity_lines(figures)
    lines.append(
        "beam cases      "
        + "  ".join(f"{case.words} {100 * figures['case_share'][str(case.value)]:.1f} %" for case in CASES_IN_ORDER)
    )
    return lines + _case_lines(figures["cases"]) + _surface_lines(figures["scan_surfaces"])


def _relative_lines(figures: Dict[str, Any]) -> List[str]:
    """Lines of the relative errors; evo's definitions, see relative_errors.py."""
    over = [
        f"over {name} {figures[f'relative_{key}_rmse_m']:.4f} m, {figures[f'relative_{key}_yaw_rmse_deg']:.3f} deg"
        for key, name in (("1m", "1 m"), ("1s", "1 s"))
        if figures[f"relative_{key}_rmse_m"] is not None
    ]
    if not over:
        return []
    return [f"relative rmse   {'  '.join(over)}; aligned position {figures['aligned_rmse_m']:.4f} m"]


def _integrity_lines(figures: Dict[str, Any]) -> List[str]:
    if figures["misleading_share"] is None:
        return []
    lines = [
        f"integrity       {100 * figures['misleading_share']:.2f} % misleading, at most "
        f"{figures['misleading_max_s']:.1f} s and {figures['misleading_max_m']:.2f} m in a row; false alarms "
        f"{100 * figures['alarm_share']:.2f} %; NEES median {_figure(figures['nees_median'], 2)} "
        f"(consistent: {CONSISTENT_NEES:.2f}); 99.9 % level {_figure(figures['level_ratio'], 1)} times the error's 95 %"
    ]
    if figures["time_to_alarm_s"] != 0.0 or figures["time_back_s"] != 0.0:
        to_alarm, back = (
            "never" if figures[name] is None else f"after {figures[name]:.1f} s"
            for name in ("time_to_alarm_s", "time_back_s")
        )
        lines.append(f"  wrong pose      alarm {to_alarm}, right and LOCALIZED again {back}")
    return lines


def _case_lines(scores: Optional[Dict[str, Any]]) -> List[str]:
    if scores is None:
        return []
    lines = [
        f"reported cases  {_figure(scores['accuracy'])} of {scores['beams']} beams correct, "
        f"{_figure(scores['accuracy_answered'])} of those that returned; macro F1 {_figure(scores['macro_f1'])}; "
        f"{_figure(scores['used_share'])} used",
        f"  {'':22s}{'true':>9s}{'reported':>9s}{'precision':>11s}{'recall':>8s}{'F1':>8s}",
    ]
    for case in CASES_IN_ORDER:
        share, reported = (100 * (scores[key][case] or 0.0) for key in ("true_share", "told_share"))
        precision, recall, f1 = (_figure(scores[key][case]) for key in ("precision", "recall", "f1"))
        lines.append(f"  {case.label:22s}{share:7.1f} %{reported:7.1f} %{precision:>11s}{recall:>8s}{f1:>8s}")
    return lines


def _surface_lines(scores: Optional[Dict[str, Any]]) -> List[str]:
    if scores is None:
        return []
    return [
        f"scan_surfaces   {_figure(scores['cut_at_pane_share'])} of {scores['at_pane']} beams that passed or were "
        f"mirrored at a pane cut within {NEAR_M:g} m of it, {_figure(scores['cut_wrongly_share'], 4)} of the "
        f"others cut; pose trusted in {_figure(scores['trusted_share'])} of the scans"
    ]


def _figure(value: Optional[float], digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _metres(value: Optional[float]) -> str:
    return "infinite" if value is None else f"{value:.3f} m"


def smoothed_lines(figures: Optional[Dict[str, Any]]) -> List[str]:
    """Distances of the filter and the ground truth from the smoothed trajectory; none if it was not asked for."""
    if figures is None:
        return []
    lines = [f"from smoothed   {_distances(figures['filter_from_smoothed'])}"]
    if figures["smoothed_from_truth"]["position_mean_m"] is not None:
        lines.append(f"smoothed error  {_distances(figures['smoothed_from_truth'])}")
    return lines


def _distances(errors: Dict[str, Optional[float]]) -> str:
    return (
        f"mean {_metres(errors['position_mean_m'])}  rmse {_metres(errors['position_rmse_m'])}  "
        f"max {_metres(errors['position_max_m'])}  yaw mean {_figure(errors['yaw_mean_deg'], 2)} deg"
    )


def topology_lines(figures: Optional[Dict[str, Any]]) -> List[str]:
    """The figures of TopologyScore.metrics() for people; none where no atlas was given."""
    if figures is None:
        return []
    why = figures["missed_why"]
    lines = [
        f"topology        {'':12s}{'passed':>8s}{'seen':>8s}{'missed':>8s}{'false pos.':>12s}{'degree right':>14s}"
    ]
    for name, row in (("meetpoints", figures["meetpoints"]), ("dead ends", figures["dead_ends"]), ("all", figures)):
        share = "-" if row["degree_right_share"] is None else f"{100 * row['degree_right_share']:.0f} %"
        seen = f"{row['seen']}" if row["seen_share"] is None else f"{row['seen']} ({100 * row['seen_share']:.0f} %)"
        lines.append(
            f"  {name:14s}{'':12s}{row['passed']:8d}{seen:>11s}{row['missed']:5d}{row['invented']:12d}{share:>14s}"
        )
    lines.append(
        f"  missed          {why['doubtful']} whose obstacles were not seen well enough, {why['unsteady']} "
        f"that came and went, {why['nothing']} where nothing was seen"
    )
    lines.append(f"  seen nodes      off by {_off(figures['position_off_m'])}, r by {_off(figures['r_off_m'])}")
    lines.append(
        f"  edges           {figures['edges_driven']} between two seen nodes: length off by "
        f"{_off(figures['edge_length_off_m'])}, chord by {_off(figures['edge_chord_off_m'])}"
    )
    return lines


def _off(spread: Dict[str, Optional[float]]) -> str:
    if spread["median_abs"] is None:
        return "-"
    return f"{spread['median_abs']:.2f} m (median, p95 {spread['p95_abs']:.2f} m)"
