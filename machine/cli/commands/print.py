"""The print command: a model or a G-code file on a printer at a port, or on the simulated one."""

from dataclasses import replace

from machine.cli.commands.send import print_on_server
from machine.cli.terminal.report import print_table
from machine.firmware.firmware import check_baud
from machine.notices import show
from machine.pipeline.file_roles import check_model_files, printing_files, program_beside
from machine.pipeline.output import check_writable
from machine.pipeline.programs import load_program
from machine.pipeline.requests import ModelRequest, PrintRequest
from machine.printing.attendance import AtTerminal
from machine.printing.compatibility import check_machine, check_port, ready_program
from machine.printing.journal_folder import check_new_journal
from machine.printing.servers.address import is_server_address
from machine.printing.stream import print_program
from machine.view.serving.watch_page import serve_watch_page


def print_model(request: ModelRequest, printing: PrintRequest) -> int:
    """Dry-run, then stream a model or a G-code file to a printer, which is asked who it is before any work is done."""
    if is_server_address(printing.port):
        return print_on_server(request, printing)
    for file in (printing.log, printing.journal):
        if file is not None:
            check_writable(file)
    check_model_files(request, printing_files(printing))
    if printing.journal is not None:
        check_new_journal(printing.journal, None if request.is_gcode else program_beside(printing.journal))
    check_baud(printing.baud)
    answer = check_port(printing.port, printing.baud, printing.sim_speed)
    if not request.is_gcode:
        check_machine(answer, request.profile.machine, request.force)
    loaded = load_program(request)
    if request.is_gcode:
        check_machine(answer, loaded.profile.machine, request.force)
    program = ready_program(answer, loaded.program, loaded.profile, name=loaded.name, printing=printing, force=request.force)
    show(print_table(program, loaded.profile))
    job = replace(loaded, program=program)
    person = AtTerminal()
    with serve_watch_page(job, printing.watch_port, person.control, printing.browser) as watched:
        code = print_program(job, printing, watched.follow, person)
        watched.end("stopped" if code else "done")
    return code
