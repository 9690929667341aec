"""Tables of the page: which fields of which rows, under which heads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import rows
from rows import Raw


@dataclass
class RawTable:
    """columns: head and field, or head, field and the factor of its numbers."""

    run: str
    title: str
    columns: "list[tuple]"
    where: "dict[str, Any]" = field(default_factory=dict)
    text: str = ""


NUMBER = {"at least": -1e300}  # any number

TABLES = [
    RawTable("spacetime", "Space-time solve beside the paper's method", [
        ("scene", "scene"), ("tets", "tets"), ("frames", "frames"), ("constraints", "constraints"),
        ("paper, cold [ms]", "literal_cold_ms"), ("limber, cold [ms]", "cold_ms"), ("speedup", "speedup_cold"),
        ("first motion after an edit [ms]", "warm_first_ms"), ("all frames [ms]", "warm_first_frames_ms"),
        ("converged [ms]", "warm_converged_ms"), ("p99 [ms]", "warm_converged_p99_ms"),
        ("energies differ by", "energy_relative_difference")]),
    RawTable("service", "Edits over sockets, the flower", [
        ("journal", "journal"), ("edits", "edits"), ("commits a second", "commits_per_s"), ("acknowledged, p50 [ms]", "edit_to_ack_p50_ms"), ("p99", "edit_to_ack_p99_ms"),
        ("first changed frames, p50 [ms]", "edit_to_first_frame_p50_ms"), ("p99", "edit_to_first_frame_p99_ms"),
        ("final frames, p50 [ms]", "edit_to_converged_p50_ms"), ("p99", "edit_to_converged_p99_ms")]),
    RawTable("reconstruct", "Frames of models of default options", [
        ("body", "scene"), ("tets", "tets"), ("h", "basis"), ("cubature", "cubature_tets"), ("full [us]", "full_us"),
        ("batch [us/frame]", "batch_us_per_frame"), ("mean error [%]", "error_mean", 100), ("speedup", "speedup")]),
    RawTable("build", "Models of default options", [
        ("body", "scene"), ("tets", "tets"), ("build [s]", "build_s"), ("peak [MB]", "peak_mb"), ("h", "basis"),
        ("cubature", "cubature_tets"), ("mean error [%]", "error_mean", 100)]),
    RawTable("basis", "Where a basis comes from: mean error on held-out poses", [
        ("body", "scene"), ("h", "basis"), ("snapshots [%]", "snapshots_error", 100),
        ("modal derivatives [%]", "modal_derivatives_error", 100), ("map derivatives [%]", "map_derivatives_error", 100)]),
    RawTable("table1", "The paper's table 1, the row that --quick measures: ours and printed", [
        ("body", "scene"), ("basis [s]", "basis_s"), ("printed", "paper_basis_s"), ("cubature [s]", "cubature_s"),
        ("printed", "paper_cubature_s"), ("error, fitted [%]", "cubature_error_of_30", 100),
        ("weights", "weights_cubature_error_of_30", 100), ("printed", "paper_cubature_error", 100),
        ("optimisation [s]", "optimise_s"), ("printed", "paper_optimise_s")]),
    RawTable("exact", "The exact optimum compared with the reduced one", [
        ("body", "scene"), ("tets", "tets"), ("reduced", "energy_reduced"), ("exact", "energy_exact"), ("judge", "energy_judge"),
        ("reduced is off by [%]", "energy_error_reduced", 100), ("exact by [%]", "energy_error_exact", 100),
        ("exact step [ms]", "polish_ms"), ("steps", "polish_steps"), ("shapes of the model off by [%]", "shape_error_before", 100),
        ("judge has settled", "judge_settled")],
        text="The judge is a plainly written full-space solver of the same start; where it has not settled, the exact step may "
             "be below it."),
    RawTable("modes", "How many modes a scene needs, and what fewer of them save", [
        ("scene", "scene"), ("tets", "tets"), ("energy with 30", "energy_30"), ("modes", "modes"), ("energy", "energy_chosen"),
        ("half more save [%]", "saving", 100), ("choice [ms]", "choice_ms"), ("fewest", "fewest"),
        ("first result [ms]", "first_30_ms"), ("with the fewest", "first_fewest_ms"), ("final result [ms]", "final_30_ms"),
        ("with the fewest", "final_fewest_ms"), ("shapes of the fewest off by [%]", "shape_fewest", 100)]),
    RawTable("editors", "Editors beside each other", [
        ("body", "scene"), ("targets", "targets"), ("editor", "editor"), ("shapes by", "reconstruction"), ("modes", "modes"),
        ("solve [ms]", "solve_ms"), ("shapes [us/frame]", "frame_us"), ("constraint error [%]", "constraint_max_pct"),
        ("control forces", "force_energy"), ("shape error [%]", "shape_error_pct")]),
    RawTable("material", "Material optimisation beside the paper's alternation", [
        ("scene", "scene"), ("variables", "mode"), ("alternation [ms]", "literal_ms"), ("its energy", "literal_energy"),
        ("limber [ms]", "ours_ms"), ("its energy", "ours_energy"), ("to the alternation's [ms]", "ms_to_literal_energy"),
        ("ratio", "speedup"), ("forces, z alone", "force_energy_z_only"), ("forces, all", "force_energy_all"),
        ("power above half Nyquist", "high_share")],
        text="A ratio of 0: the alternation's energy was not reached, limber settled in another minimum. Forces are compared "
             "where no constraint is missed by more than 0.1 % of the body."),
    RawTable("recovery", "Recovery of material, the beam, 120 frames", [
        ("scene", "scene"), ("modes", "modes"), ("variables", "variables"), ("E_f", "e_force"), ("E_c", "e_constraint"),
        ("least E_c", "least_constraint"), ("last frame [%]", "final_frame_error", 100),
        ("second half [%]", "second_half_error", 100), ("ms", "ms")]),
    RawTable("rods", "Single rods at 40 edges", [
        ("problem", "problem"), ("form", "form"), ("error [%]", "error_percent"),
        ("with 20 edges, extrapolated [%]", "extrapolated_error_percent"), ("steps", "iterations"), ("ms", "ms")],
        {"edges": 40}),
    RawTable("linkage", "Linkages deployed", [
        ("linkage", "model"), ("unknowns", "dofs"), ("iterations", "iterations"), ("wall [s]", "wall_s"),
        ("public code's over it", "wall_ratio"), ("ms an iteration", "ms_per_iteration"),
        ("public code's over it", "iteration_ratio"), ("Hessian [ms]", "hessian_ms"), ("factor [ms]", "factorization_ms"),
        ("retarget [ms]", "retarget_ms"), ("energies differ by", "energy_difference")],
        text="The public code's figures are its own, from another machine."),
    RawTable("linkage_drag", "A target of a linkage dragged once around a circle", [
        ("linkage", "linkage"), ("unknowns", "unknowns"), ("moves", "edits"), ("first shape [ms]", "first_ms"),
        ("19 of 20 within", "first_most_ms"), ("equilibrium [ms]", "final_ms"), ("first shape off by", "correction_error"),
        ("moves shown", "shown"), ("failed", "failed")]),
    RawTable("linkage_solver", "One Newton iteration, part by part", [
        ("linkage", "model"), ("unknowns", "dofs"), ("threads", "threads"), ("Hessian [ms]", "hessian_ms"),
        ("factor [ms]", "factorization_ms"), ("CHOLMOD [ms]", "cholmod_factorization_ms"), ("solve [ms]", "solve_ms"),
        ("energy [ms]", "energy_ms")]),
    RawTable("design", "Derivatives of designs", [
        ("linkage", "model"), ("lengths", "parameters"), ("gradient [ms]", "gradient_ms"), ("CPU [ms]", "gradient_cpu_ms"),
        ("product [ms]", "hessvec_ms"), ("CPU [ms]", "hessvec_cpu_ms"), ("check of gradients", "gradient_check"),
        ("of products", "hessvec_check"), ("distance before", "target_rms_before"), ("after 10 steps", "target_rms_after")]),
    RawTable("beams", "Beams: known answers", [
        ("case", "case"), ("method", "method"), ("elements", "elements"), ("status", "status"), ("error [%]", "error", 100),
        ("steps", "steps"), ("ms", "wall_s", 1000)], {"elements": 20}),
    RawTable("beams", "The paper's relaxation, known answers", [
        ("case", "case"), ("elements", "elements"), ("status", "status"), ("error [%]", "error", 100), ("steps", "steps"),
        ("ms", "wall_s", 1000)], {"method": "the paper's chart", "elements": NUMBER}),
    RawTable("beams", "Public structures", [
        ("structure", "case"), ("element", "element"), ("nodes", "nodes"), ("steps", "steps"),
        ("us per node and step", "us_per_node_step"), ("one by one", "us_per_node_step_plain"), ("relaxation [s]", "relaxation_s"),
        ("Newton [s]", "newton_s"), ("chosen [s]", "chosen_s"), ("ends", "chosen"), ("public code [s]", "public_s"),
        ("rms from its places [m]", "rms_from_public")], {"public_s": NUMBER}),
    RawTable("beams", "Public structures by the paper's relaxation and by ours, the same element", [
        ("structure", "case"), ("ends", "status"), ("steps", "steps"), ("us per node and step", "us_per_node_step"),
        ("ours", "our_us_per_node_step"), ("relaxation [s]", "relaxation_s"), ("ours", "our_relaxation_s"), ("factor", "speedup")],
        {"speedup": NUMBER}),
    RawTable("beam_edits", "Edits of the roof", [
        ("edit", "edit"), ("edits", "number"), ("ends", "ended"), ("median [ms]", "edit_ms"), ("most", "edit_ms_max"),
        ("user CPU, median [ms]", "user_ms"), ("most", "user_ms_max"), ("factorizations, median", "factorizations"),
        ("most", "factorizations_max")], {"edit_ms_max": NUMBER}),
    RawTable("estimates", "Estimates of discretisation errors against the truth", [
        ("of", "kind"), ("errors", "errors"), ("within a factor of 3 [%]", "within_3", 100), ("least over the truth", "least_ratio"),
        ("most", "largest_ratio")], {"case": "all"},
        text="Positions and energies of known answers, domes and burd, with 3 to 40 edges or elements; truth by edges an "
             "eighth, elements a sixteenth as long."),
    RawTable("cholesky", "Cholesky factors: CHOLMOD's supernodal module and our own", [
        ("body", "body"), ("rows", "rows"), ("analysis [ms]", "analysis_ms"), ("own", "own_analysis_ms"),
        ("factor [ms]", "factor_ms"), ("own", "own_factor_ms"), ("solve [ms]", "solve_ms"), ("own", "own_solve_ms"),
        ("16 solves [ms]", "solve_16_ms"), ("own", "own_solve_16_ms"), ("answers differ by", "difference")]),
    RawTable("streams", "Streams", [
        ("scene", "scene"), ("what is sent", "method"), ("tolerance", "tolerance"), ("bytes a frame", "bytes_per_frame"),
        ("bytes once", "bytes_once"), ("mean error [%]", "error", 100)]),
    RawTable("ratios", "Ratios of CPU time that scripts/check-ratios guards", [
        ("pair", "pair"), ("ratio", "ratio"), ("least", "ratio_least"), ("most", "ratio_most"), ("limber [ms]", "ours_cpu_ms"),
        ("plain [ms]", "plain_cpu_ms"), ("limber does", "ours"), ("plain is", "plain")]),
]


def rows_of(table: RawTable, raw: Raw) -> "list[rows.Row]":
    """The rows that a table has, in their order."""
    return rows.select(raw.cases.get(table.run, []), table.where)
