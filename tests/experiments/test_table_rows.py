"""Every row of every table can be made: its settings exist and its model takes the poses of its corpus."""

from dataclasses import fields, replace

import pytest

from a2g_jax.models import find_model
from experiments.audio2gestures import long, select, table1, table2, table3, table4, table5, table6
from experiments.audio2gestures import real as real_takes
from experiments.stylized_flow import real as flow_takes
from experiments.stylized_flow import table1 as flow_table1
from experiments.stylized_flow import table2 as flow_table2
from experiments.stylized_flow import table3 as flow_table3

#: Rows, and how their corpus writes down poses.
TABLES = {
    "audio2gestures table 1, 3D": (table1.TABLES["audio2gestures/table1_3d"][1], "6d"),
    "audio2gestures table 1, 2D": (table1.TABLES["audio2gestures/table1_2d"][1], "keypoints"),
    **{
        f"audio2gestures {module.__name__.split('.')[-1]}": (module.VARIANTS, "6d")
        for module in (table2, table3, table4, table5, table6, real_takes, long, select)
    },
    "flow table 1, Trinity": (flow_table1.rows("trinity"), "exponential"),
    "flow table 1, TED": (flow_table1.rows("ted"), "directions"),
    "flow table 2": (flow_table2.VARIANTS, "directions"),
    "flow table 3": (flow_table3.VARIANTS, "directions"),
    "flow on a take": (flow_takes.without_perceptual("trinity"), "exponential"),
    "flow on TED clips": (flow_takes.without_perceptual("ted"), "directions"),
}


@pytest.mark.parametrize("name", TABLES)
def test_rows_can_be_made(name):
    rows, representation = TABLES[name]
    assert rows
    for title, row in rows.items():
        model = find_model(row.model)
        assert not model.poses or representation in model.poses, title
        of_sampling = {field.name for field in fields(model.sampling)}
        changes = {**row.changes, **(row.generation or {})}
        replace(model.presets[row.preset], **{name: changes[name] for name in changes if name not in of_sampling})
        replace(model.sampling(), **{name: changes[name] for name in changes if name in of_sampling})
        assert row.trained_as in ("", *rows), title
        # Rows are named on the command line with commas between them.
        assert "," not in title or "table2" in name or name.endswith("long")


def test_rows_named_after_a_paper_have_its_settings():
    """Nothing of ours in them but size and time."""
    paper = find_model("audio2gestures").presets["paper"]
    row = table2.VARIANTS["full, the paper's weights"].changes
    for name, value in {
        "alignment_weight": 0.1,
        "kl_shared_weight": 1e-3,
        "kl_specific_weight": 1e-3,
        "bicycle_weight": 0.1,
        "diversity_weight": 0.1,
        "speed_weight": 5.0,
        "sampled_speed_weight": 0.0,
        "relaxed_threshold": 0.002,
    }.items():
        assert row[name] == getattr(paper, name) == value
    for protocol in ("trinity", "ted"):
        rows = flow_table1.rows(protocol)
        ours, published = rows["stylized flow"].changes, rows["stylized flow as published"].changes
        assert published == {**ours, "predictor": False}
        assert "adversarial_weight" not in rows["Speech2Gesture"].changes


def test_only_the_losses_differ_on_takes():
    assert all(
        row.changes.get("perceptual_weight", 0.0) == 0.0 for row in flow_takes.without_perceptual("trinity").values()
    )
    assert flow_table1.rows("trinity")["stylized flow"].changes["perceptual_weight"] > 0
