"""The command line: `patchwright check | repair | intersect | reparam | approximate | convert | curves | run | demo`.

Only here do errors become sentences and exit codes: 0 done, 1 defects found, refused or not converged, 2 bad usage or
input, 3 internal failure. Heavy packages are imported inside the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import os
import sys
import warnings
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from patchwright.models.errors import EngineError, GeometryError
from patchwright.pipelines.domain_options import (
    FarField,
    Fluid,
    Gap,
    Opening,
    PartTolerance,
    Symmetry,
    domain_of,
)

if TYPE_CHECKING:
    from patchwright.pipelines.progress import Terminal
    from patchwright.pipelines.study import Study

DONE, FOUND, BAD_INPUT, INTERNAL = 0, 1, 2, 3
INTERRUPTED = "interrupted; nothing half-written was left"

app = typer.Typer(
    name="patchwright",
    help="Gets dirty CAD ready for CFD surface grids: mends STL and STEP with the least change, and says what changed.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


class Scope(StrEnum):
    """How much a repair may touch."""

    least = "least"
    all = "all"


class Openings(StrEnum):
    """What becomes of planned openings."""

    keep = "keep"
    close = "close"


Json = Annotated[bool, typer.Option("--json", help="Machine output on stdout, everything else on stderr.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]


@app.command()
def check(
    files: Annotated[list[str], typer.Argument(help="Files, folders and globs.", show_default=False)],
    fail_on: Annotated[
        str, typer.Option("--fail-on", help="KIND[,KIND...], error, warning or never: what makes the check fail.")
    ] = "warning",
    baseline: Annotated[
        Path | None, typer.Option("--baseline", help="Defects listed in this file do not make the check fail.")
    ] = None,
    write_baseline: Annotated[
        Path | None, typer.Option("--write-baseline", help="Write all defects found to this file, and pass.")
    ] = None,
    farfield: FarField = None,
    symmetry: Symmetry = None,
    fluid: Fluid = None,
    opening: Opening = None,
    gap: Gap = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what is wrong with each file and where; exit code 1 when anything counts, 2 when a file cannot be read."""
    from patchwright.pipelines.check import FailOn, checked_json, run_check
    from patchwright.pipelines.summary import checked_lines

    results = run_check(
        files,
        fail_on=FailOn.of(fail_on),
        baseline=baseline,
        write=write_baseline,
        domain=domain_of(farfield, symmetry, fluid, opening, gap),
        terminal=_terminal(quiet),
    )
    for result in results:
        if result.error:
            _fail(result.error, BAD_INPUT)
        elif not json:
            _say("\n".join(checked_lines(result)))
    if json:
        told = [checked_json(result) for result in results]
        _say_json(told[0] if len(told) == 1 else told)
    if any(result.error for result in results):
        raise typer.Exit(INTERNAL if any(result.internal for result in results) else BAD_INPUT)
    raise typer.Exit(FOUND if any(result.failing for result in results) else DONE)


@app.command()
def repair(
    file: Annotated[Path, typer.Argument(help="STL, OBJ, PLY, OFF, Cart3D, Plot3D, STEP or IGES.", show_default=False)],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Output folder [<stem>-patchwright].")] = None,
    scope: Annotated[Scope, typer.Option(help="least keeps what is good; all resurfaces everything.")] = Scope.least,
    openings: Annotated[Openings, typer.Option(help="Keep or close planned openings.")] = Openings.keep,
    tolerance: Annotated[
        float | None, typer.Option(help="Fit tolerance in model units [1e-4 of the diagonal].")
    ] = None,
    layout: Annotated[
        Path | None, typer.Option("--layout", help="Patches laid out as in this file, such as an edited layout.json.")
    ] = None,
    time_limit: Annotated[
        float, typer.Option("--time-limit", min=1.0, help="Seconds after which nothing new is begun on CAD faces.")
    ] = 600.0,
    farfield: FarField = None,
    symmetry: Symmetry = None,
    fluid: Fluid = None,
    opening: Opening = None,
    gap: Gap = None,
    part_tolerance: PartTolerance = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell what would be done, item by item; --json gives the plan.")
    ] = False,
    write_plan: Annotated[
        Path | None, typer.Option("--write-plan", help="With --dry-run: write the plan to this file, to be edited.")
    ] = None,
    plan: Annotated[
        Path | None, typer.Option("--plan", help="Follow a reviewed plan: its rejected items are left out.")
    ] = None,
    reject: Annotated[
        list[str] | None, typer.Option("--reject", help="With --plan: id of one more item to reject (repeatable).")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Mend a file: closed model, NURBS patches, surface grid, and a report of every change."""
    from patchwright.pipelines.recipe import repair_recipe
    from patchwright.pipelines.run import run

    if write_plan is not None and not dry_run:
        raise typer.BadParameter("--write-plan goes with --dry-run")
    if reject and plan is None:
        raise typer.BadParameter("--reject goes with --plan: make one with --dry-run --write-plan FILE")
    recipe = repair_recipe(
        file,
        output,
        scope=scope.value,
        openings=openings.value,
        layout=str(layout) if layout else "auto",
        time_limit=time_limit,
        tolerance=tolerance,
        domain=domain_of(farfield, symmetry, fluid, opening, gap, part_tolerance),
        plan=plan,
        reject=tuple(reject or ()),
    )
    if dry_run:
        from patchwright.pipelines.planning import run_plan
        from patchwright.pipelines.summary import plan_lines

        made = run_plan(recipe, write=write_plan, terminal=_terminal(quiet))
        if json:
            _say_json(made.to_json())
        else:
            _say("\n".join(plan_lines(made)))
        raise typer.Exit(FOUND if made.problems else DONE)
    _finish(run(recipe, terminal=_terminal(quiet)), json)


@app.command()
def demo(
    output: Annotated[Path, typer.Option("-o", "--output", help="Output folder.")] = Path("demo-patchwright"),
    seed: Annotated[int, typer.Option(help="Seed of the injected defects.")] = 1,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make a dirty aircraft, repair it, and compare the result with the known truth."""
    from patchwright.pipelines.demo import run_demo

    _finish(run_demo(output, seed=seed, terminal=_terminal(quiet)), json)


@app.command("run")
def run_(
    recipe: Annotated[Path, typer.Argument(help="Recipe (TOML).", show_default=False)],
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a recipe: a TOML file with source, folder and stages."""
    from patchwright.pipelines.run import run

    _finish(run(recipe, terminal=_terminal(quiet)), json)


@app.command()
def intersect(
    files: Annotated[list[Path], typer.Argument(help="Two or more files; one alone with itself.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Curves: .step .igs .vtp .vtk .p3d, or the report as .json.")
    ] = None,
    tolerance: Annotated[float | None, typer.Option(help="Length in model units [1e-10 of the size].")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the files that store none [that of the others].")] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find every curve and point that surfaces, meshes and assemblies share; exit code 1 when any place stays open."""
    from patchwright.pipelines.intersect import run_intersect, sections_json, sections_lines

    result = run_intersect(files, output, tolerance=tolerance, terminal=_terminal(quiet), unit=unit)
    names = [str(f) for f in files]
    if json:
        _say_json(sections_json(result, names))
    else:
        _say("\n".join(sections_lines(result, names)))
    raise typer.Exit(DONE if result.found.complete else FOUND)


@app.command()
def reparam(
    file: Annotated[Path, typer.Argument(help="STEP or IGES.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="STEP or IGES to write.", show_default=False)],
    tolerance: Annotated[float | None, typer.Option(help="Length in model units [1e-4 of the diagonal].")] = None,
    face: Annotated[
        list[str] | None, typer.Option(help="Only faces of this name; may be repeated.", show_default=False)
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Give CAD faces parameter lines spaced as they lie in space; exit code 1 when a face asked for had to be left."""
    from patchwright.pipelines.reparam import reparam_json, reparam_lines, run_reparam

    result = run_reparam(file, output, tolerance=tolerance, names=face or [], terminal=_terminal(quiet))
    if json:
        _say_json(reparam_json(result))
    else:
        _say("\n".join(reparam_lines(result)))
    raise typer.Exit(DONE if result.complete else FOUND)


@app.command()
def approximate(
    file: Annotated[Path | None, typer.Argument(help="Geometry to lay patches on.", show_default=False)] = None,
    patches: Annotated[
        Path | None, typer.Option("--patches", help="TOML: four sides or corners for every patch.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="STEP or IGES, or a folder for figures.", show_default=False)
    ] = None,
    tolerance: Annotated[float | None, typer.Option(help="Length in model units [1e-4 of the diagonal].")] = None,
    paper_figures: Annotated[
        bool, typer.Option("--paper-figures", help="The paper's repair examples as pictures and numbers.")
    ] = False,
    bodies: Annotated[bool, typer.Option(help="With --paper-figures: car body and aircraft too.")] = True,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Lay bicubic patches with given sides over a dirty geometry; exit code 1 when one is not within the tolerance."""
    if paper_figures:
        from patchwright.pipelines.paper_patches import run_paper_figures

        if file or patches:
            raise typer.BadParameter("--paper-figures makes its own shapes; leave the file and --patches out")
        told, lines = run_paper_figures(output or Path("paper-figures"), bodies=bodies, terminal=_terminal(quiet))
        if json:
            _say_json(told)
        else:
            _say("\n".join(lines))
        raise typer.Exit(DONE)
    from patchwright.pipelines.approximate import approximate_json, approximate_lines, run_approximate

    if file is None or patches is None or output is None:
        raise typer.BadParameter("needs a geometry, --patches FILE and -o FILE")
    run = run_approximate(file, patches, output, tolerance=tolerance, terminal=_terminal(quiet))
    if json:
        _say_json(approximate_json(run))
    else:
        _say("\n".join(approximate_lines(run)))
    raise typer.Exit(DONE if run.converged else FOUND)


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(help="File to read.", show_default=False)],
    target: Annotated[Path, typer.Argument(help="File to write; its suffix picks the format.", show_default=False)],
    quiet: Quiet = False,
) -> None:
    """Read one format and write another, repairing nothing."""
    from patchwright.models.io import read, write
    from patchwright.models.io.registry import format_of

    format_of(target)
    with _terminal(quiet).stage("convert") as report:
        report("reading", 0.0)
        assembly = read(source)
        report("writing", 0.5)
        write(target, assembly)
    triangles = sum(len(part.triangulation) for part in assembly.parts)
    _say(f"{source} -> {target}: {len(assembly.parts)} parts, {triangles} triangles")


@app.command()
def curves(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for pictures and curves.json.")] = None,
    paper_tables: Annotated[
        bool, typer.Option("--paper-tables", help="The tables and figures of two papers, computed beside the printed.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show the interpolation schemes and what each claims; with --paper-tables, the tables of their papers."""
    from patchwright.pipelines.curves import curves_json, curves_lines, run_curves

    run = run_curves(output, paper_tables=paper_tables, terminal=_terminal(quiet))
    if json:
        _say_json(curves_json(run.tables))
    else:
        _say("\n".join(curves_lines(run)))


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        _say(f"patchwright {version('patchwright')}")
        raise typer.Exit(DONE)


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


def _terminal(quiet: bool) -> Terminal:
    from patchwright.pipelines.progress import Terminal

    terminal = Terminal(quiet=quiet)
    warnings.showwarning = lambda message, *rest, **more: terminal.line(f"  warning: {message}")
    return terminal


def _finish(study: Study, json: bool) -> None:
    """Print the outcome and leave with its exit code."""
    from patchwright.pipelines.summary import study_json, study_lines
    from patchwright.repair.result import Verdict

    if json:
        _say_json(study_json(study))
    else:
        _say("\n".join(study_lines(study)))
    repaired = study.repaired
    short = repaired is not None and not (repaired.verdict is not Verdict.REFUSED and repaired.converged)
    raise typer.Exit(FOUND if short else DONE)


_stdout = 1  # the descriptor results go to; `main` keeps the real one and sends native chatter to stderr


def _say(text: str) -> None:
    os.write(_stdout, (text + "\n").encode())


def _say_json(value: Any) -> None:
    import json

    _say(json.dumps(value, indent=1, allow_nan=False))


def main() -> None:
    """Entry point of the console script."""
    global _stdout
    if not any(word in ("--help", "-h") for word in sys.argv[1:]) and len(sys.argv) > 1:
        sys.stdout.flush()
        _stdout = os.dup(1)
        os.dup2(2, 1)
    try:
        code = typer.main.get_command(app).main(standalone_mode=False)
    except EngineError as error:
        code = _fail(str(error), INTERNAL)
    except GeometryError as error:
        code = _fail(str(error), BAD_INPUT)
    except BrokenPipeError:
        code = DONE
    except KeyboardInterrupt:
        code = _fail(INTERRUPTED, 130)
    except MemoryError:
        code = _fail("out of memory; try a coarser file or a larger machine", INTERNAL)
    except Exception as error:
        if hasattr(error, "show") and hasattr(error, "exit_code"):  # typer's usage errors, whichever click it runs on
            error.show()
            sys.exit(BAD_INPUT)
        if type(error).__name__ == "Abort":
            sys.exit(_fail(INTERRUPTED, 130))
        if os.environ.get("PATCHWRIGHT_TRACEBACK"):
            raise
        sentence = (
            f"internal failure ({type(error).__name__}: {error}); set PATCHWRIGHT_TRACEBACK=1 and report the trace"
        )
        code = _fail(sentence, INTERNAL)
    sys.exit(code if isinstance(code, int) else DONE)


def _fail(sentence: str, code: int) -> int:
    print(f"patchwright: {sentence}", file=sys.stderr)  # noqa: T201
    return code


if __name__ == "__main__":
    main()
