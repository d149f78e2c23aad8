"""The simulate command: the dry run of a model or a G-code file, with its plastic compared with the model.

Modules that only some options need are imported when such an option is given.
"""

from dataclasses import asdict, replace
from pathlib import Path

from machine.cli.terminal.report import agreement_line, print_price, print_table, verdict, written_line
from machine.dryrun.dryrun import summary
from machine.firmware.firmware import check_baud
from machine.notices import show
from machine.pipeline.output import check_model_files, write_bytes, write_json
from machine.pipeline.programs import load_program
from machine.pipeline.project import open_project
from machine.pipeline.requests import STDOUT, ModelRequest
from mdp.model_file import check_file, locate
from profiles.errors import ProfileError


def simulate(request: ModelRequest, reference: str | None = None, baud: int | None = None) -> int:
    """Dry-run a model or a G-code file; returns 1 if a finding is an error.

    reference: model to compare a G-code file's plastic with. baud: check whether a line of this rate starves the printer.
    """
    outputs = request.outputs
    check_model_files(request, (), ("--model", None if reference is None else Path(reference)))
    if baud is not None:
        check_baud(baud)
    if reference is not None:
        if not request.is_gcode:
            raise ProfileError(f"--model {reference}: {request.model} is a model itself; --model goes with a G-code file")
        project = open_project(reference)
        plate = request.plate
        if project is not None:
            project.check_plate(plate, Path(reference))
            plate = project.plate
        reference = reference if project is None else project.argument
        check_file(locate(reference))
    loaded = load_program(request)
    program, profile = loaded.program, loaded.profile
    mesh = None if program.decomposition is None else program.decomposition.mesh
    if reference is not None:
        from machine.planning.fit import mesh_at_place
        from mdp.read import read_model

        model = read_model(locate(reference), profile.process.scale, profile.process.rotate_deg, plate)
        mesh = mesh_at_place(model.mesh, profile)
    agreed = None
    if mesh is not None:
        from machine.dryrun.agreement import agreement

        modifiers = () if program.decomposition is None else program.decomposition.parts[0].modifiers
        agreed, run = agreement(program.run, mesh, profile, modifiers)
        program = replace(program, run=run)
    if baud is not None:
        from machine.dryrun.starvation import find_starvation

        program = replace(program, run=find_starvation(program.run, program.lines, profile.machine, baud))
    if outputs.html is not None:
        from machine.view.page import print_page

        write_bytes(outputs.html, print_page(request.name, program, profile, known=loaded.machine_known))
    if outputs.json is not None:
        write_json(
            outputs.json,
            summary(program.run) | print_price(program, profile) | ({} if agreed is None else {"model": asdict(agreed)}),
        )
    if outputs.json != STDOUT:
        ending = written_line((outputs.html, outputs.json), verdict(program.run))
        show(print_table(program, profile) + ("" if agreed is None else agreement_line(agreed)) + ending)
    return 1 if program.run.errors else 0
