"""Reads the parameters of amcl from a launch file and translates them, with a comment on each. No roscore.

roslaunch's own loader reads the file, so includes, args, groups, rosparam files and substitutions mean what they mean
on the robot. Started by `glass_nav params` as a process of its own:
    python3 -m glass_nav.ros.tools.amcl_launch FILE.launch [--node NAME] [ARG:=VALUE ...]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import roslaunch.core
import roslaunch.substitution_args
import roslaunch.xmlloader
import rospkg
import yaml
from roslaunch.config import ROSLaunchConfig

from glass_nav import amcl_parameters, params
from glass_nav.ros.localization.params import (
    LocalizationParams,
    as_amcl_reads,
    localization_params,
    without_unknown,
)

DONE, BAD_INPUT = 0, 3
KINDS = ("amcl", "localization_node")  # programs whose parameters these are

WHY_UNUSED = {
    "bag_scan_period": "of amcl's own replay; glass_nav replay takes every scan by its stamp",
    "restore_defaults": "a button of dynamic_reconfigure, not a setting",
    "laser_model_type": "there is one sensor model here; vote_mode selects how beams are classified",
    "laser_likelihood_max_dist": "fixed: distances to walls are cut at 2 m",
    "laser_lambda_short": "a beam that ends in front of all mapped surfaces is uncertain and has no weight",
    "laser_z_short": "a beam that ends in front of all mapped surfaces is uncertain and has no weight",
    "laser_z_max": "a beam without a return has no weight",
    **dict.fromkeys(
        ("do_beamskip", "beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
        "beams are classified by what they met, instead of being skipped",
    ),
    **dict.fromkeys(
        ("recovery_alpha_slow", "recovery_alpha_fast"),
        "no random particles are added: a lost robot is searched for in the whole map",
    ),
}
WORTH_KNOWING = {
    "laser_max_beams": "720 if left out: glass is told apart by many beams, which together count for "
    "laser_independent_beams",
}


class LaunchError(ValueError):
    """The launch file has no usable parameters of amcl; one line."""


@dataclass(frozen=True)
class AmclNode:
    """A node of a launch file, as roslaunch would start it."""

    name: str
    program: str  # package/type
    values: Dict[str, Any]  # its private parameters
    remaps: "List[Tuple[str, str]]"


class _Loader(roslaunch.xmlloader.XmlLoader):  # type: ignore[misc]
    """roslaunch's loader, which names the file of every error, also in included files."""

    ignore_unset_args = False  # some versions read it without setting it

    def _parse_launch(self, filename: str, verbose: bool) -> Any:
        if not Path(filename).is_file():
            raise LaunchError(f"{filename}: does not exist")
        try:
            return super()._parse_launch(filename, verbose)
        except roslaunch.xmlloader.XmlParseException as err:
            cause = err.__context__ if isinstance(err.__context__, RecursionError) else err
            raise LaunchError(f"{filename}: {_reason(cause)}") from err

    def _recurse_load(self, ros_config: Any, tags: Any, context: Any, *others: Any) -> Any:
        try:
            return super()._recurse_load(ros_config, tags, context, *others)
        except LaunchError:
            raise
        except roslaunch.substitution_args.ArgException as err:
            raise LaunchError(f"{context.filename}: needs the arg {str(err)!r}, give {err}:=VALUE") from err
        except Exception as err:
            raise LaunchError(f"{context.filename}: {_reason(err)}") from err


def _reason(err: Exception) -> str:
    """The text of a roslaunch error, in one line."""
    if isinstance(err, rospkg.ResourceNotFound):
        return f"$(find {err.args[0]}): there is no such package"
    if isinstance(err, KeyError):
        return f"a tag lacks the attribute {err}"
    if isinstance(err, RecursionError):
        return "is included by itself"
    return " ".join(str(err).split()) or type(err).__name__


def nodes(path: Path, arguments: Sequence[str] = ()) -> List[AmclNode]:
    """The amcl nodes that a launch file starts.

    Args:
        path: of the file.
        arguments: `name:=value` of its args.

    Raises:
        LaunchError: roslaunch cannot load it; one line.
    """
    if not path.is_file():
        raise LaunchError(f"{path}: does not exist")
    config = ROSLaunchConfig()
    try:
        _Loader(resolve_anon=True).load(str(path), config, argv=list(arguments), verbose=False)
    except roslaunch.core.RLException as err:  # of the arguments
        raise LaunchError(f"{path}: {_reason(err)}") from err
    found = []
    for node in config.nodes:
        if node.type in KINDS:
            name = f"{node.namespace}{node.name}"
            values = {
                key[len(name) + 1 :]: each.value for key, each in config.params.items() if key.startswith(name + "/")
            }
            found.append(AmclNode(name, f"{node.package}/{node.type}", values, list(node.remap_args)))
    return found


def chosen(path: Path, found: Sequence[AmclNode], wanted: Optional[str]) -> AmclNode:
    """The node asked for, or the only one.

    Raises:
        LaunchError: there is none, or several and none was asked for.
    """
    names = ", ".join(node.name for node in found)
    if not found:
        raise LaunchError(f"{path}: starts no amcl, by type one of {', '.join(KINDS)}")
    if wanted is not None:
        for node in found:
            if node.name.strip("/") == wanted.strip("/"):
                return node
        raise LaunchError(f"{path}: starts no amcl of the name {wanted}; it starts {names}")
    if len(found) > 1:
        raise LaunchError(f"{path}: starts {len(found)} amcl ({names}), choose one with --node")
    return found[0]


def explained(node: AmclNode, source: str) -> str:
    """Our parameters as yaml, which rosparam and `glass_nav replay --params` load, with comments.

    Raises:
        ParamError: a value that the node would reject.
    """
    known, unknown = without_unknown(node.values, source)
    ignored: List[str] = []
    if node.program.endswith("/amcl"):
        known, ignored = as_amcl_reads(known, source)
    localization_params(known, source)  # the node would reject it, too
    taken, unused = amcl_parameters.without_unused(known, LocalizationParams)
    adapted = amcl_parameters.adapted(taken, LocalizationParams)
    defaults = params.as_mapping(LocalizationParams())
    lines = [f"# {source}: node {node.name} ({node.program})"]
    for name in sorted(adapted):
        if name not in taken and adapted[name] == defaults[name]:
            continue
        if name not in taken:
            lines.append(_line(name, adapted[name], "not in the file; the default would contradict a value that is"))
        elif defaults[name] == taken[name]:
            lines.append(_line(name, taken[name], "the default here, too"))
        else:
            lines.append(_line(name, taken[name], WORTH_KNOWING.get(name, "")))
    if unused:
        lines += ["# not used here:"]
        lines += [f"# {_line(name, known[name], WHY_UNUSED[name])}" for name in unused]
    if unknown:
        lines += ["# names that neither amcl nor this node knows; amcl ignores them too:"]
        lines += [f"# {line.partition(': ')[2].partition(';')[0]}" for line in unknown]
    if ignored:
        lines += ["# values that amcl does not read:"]
        lines += [f"# {line.partition(': ')[2]}" for line in ignored]
    if node.remaps:
        lines += ["# remaps stay in the launch file: " + ", ".join(f"{old} -> {new}" for old, new in node.remaps)]
    return "\n".join(lines)


def _line(name: str, value: Any, comment: str) -> str:
    text = yaml.safe_dump({name: value}, default_flow_style=True, width=10_000).strip()[1:-1]
    return f"{text}  # {comment}" if comment else text


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Print the parameters.

    Returns:
        0 done, 3 bad input (a line on stderr says what).
    """
    parser = argparse.ArgumentParser(prog="glass_nav params")
    parser.add_argument("file", type=Path)
    parser.add_argument("arguments", nargs="*")
    parser.add_argument("--node")
    given = parser.parse_args(argv)
    try:
        node = chosen(given.file, nodes(given.file, given.arguments), given.node)
        sys.stdout.write(explained(node, str(given.file)) + "\n")
    except ValueError as err:  # LaunchError, ParamError
        sys.stderr.write(f"glass_nav params: {err}\n")
        return BAD_INPUT
    return DONE


if __name__ == "__main__":
    sys.exit(main())
