# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# The chain of a session, a rule per stage; shard.py runs it for the sessions of a shard. Nothing of the
# archive is an input for Snakemake: what is missing there is for the programs to report, and ends
# their session alone.
from pathlib import Path
from shlex import quote

archive = Path(config["archive"])
shell.prefix(f"source {quote(workflow.basedir + '/stage.sh')}; PATH={quote(config['bin'])}:$PATH; ")


def last_of(session):
    if (archive / session / "check/truth.csv").exists():
        return session + "/evaluation.json"
    return session + ("/fixes.csv" if (archive / session / "check").exists() else "/calibration.yaml")


def in_archive(name):
    return lambda wildcards: archive / wildcards.session / name


def session_gates(wildcards):
    own = archive / wildcards.session / "gates.yaml"
    gates = own if own.exists() else config["session_gates"]
    return ["--gates", gates] if gates else []


def station(wildcards):
    """A calibration without a known station is that of the rotation."""
    return "1" if (archive / wildcards.session / "dispersion").exists() else ""


wildcard_constraints:
    session="[^/]+/[^/]+",


rule all:
    input:
        [last_of(session) for session in config["sessions"]],


rule lens:
    output:
        "{session}/lens.yaml",
    log:
        "{session}/logs/lens.txt",
    params:
        station=in_archive(""),
        camera=config["camera"],
    shell:
        "if [ -e {params.station:q}/camera.yaml ]; then stage {log} cp {params.station:q}/camera.yaml {output};"
        " else stage {log} vlp-intrinsics {params.station:q}/boards --board {params.station:q}/board.yaml"
        " {params.camera} --threads 1 -o {output}; fi"


rule row_time:
    input:
        "{session}/lens.yaml",
    output:
        "{session}/camera.yaml",
    log:
        "{session}/logs/row_time.txt",
    params:
        station=in_archive(""),
    shell:
        "if grep -q '^  row_time_s:' {input}; then cp {input} {output};"
        " else stage {log} vlp-train {params.station:q}/rotation --row-time"
        " --lamps {params.station:q}/lamps.yaml --calibration {input} --threads 1 -o {output}; fi"


rule rotation:
    input:
        "{session}/camera.yaml",
    output:
        "{session}/rotated.yaml",
    log:
        "{session}/logs/rotation.txt",
    params:
        station=in_archive(""),
    shell:
        "stage {log} vlp-rotation {params.station:q}/rotation --lamps {params.station:q}/lamps.yaml"
        " --calibration {input} -o {output}"


rule dispersion:
    input:
        "{session}/rotated.yaml",
    output:
        "{session}/calibration.yaml",
    log:
        "{session}/logs/dispersion.txt",
    params:
        station=in_archive(""),
        known=station,
    shell:
        "if [ -z {params.known:q} ]; then cp {input} {output};"
        " else stage {log} vlp-dispersion {params.station:q}/dispersion"
        " --lamps {params.station:q}/lamps.yaml --calibration {input} -o {output}; fi"


rule locate:
    input:
        "{session}/calibration.yaml",
    output:
        "{session}/fixes.csv",
    log:
        "{session}/logs/locate.txt",
    params:
        station=in_archive(""),
    shell:
        "stage {log} vlp-locate {params.station:q}/check --lamps {params.station:q}/lamps.yaml"
        " --calibration {input} -o {output}"


rule evaluate:
    input:
        "{session}/fixes.csv",
    output:
        "{session}/evaluation.json",
    log:
        "{session}/logs/evaluate.txt",
    params:
        station=in_archive(""),
        gates=session_gates,
    shell:
        "stage {log} vlp-evaluate {input} --truth {params.station:q}/check/truth.csv"
        " {params.gates:q} --threads 1 --json {output}"
