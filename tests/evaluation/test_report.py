"""Tables and pictures of made-up scores: dashes, bold, widths, escapes and cut bars."""

import json
import re
import string

import matplotlib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.evaluation import latex_text
from a2g_jax.evaluation.report import latex, markdown, read_report, write_report
from a2g_jax.evaluation.report_cells import best_runs
from a2g_jax.evaluation.report_latex import TEXT_WIDTH
from a2g_jax.evaluation.report_picture import FACTOR, limit_of
from a2g_jax.evaluation.scores import METRICS

ABOUT = {
    **{"split": "test", "clips": 30, "recordings": 30, "stretches": 30, "seconds": 1800.0, "samples": 20, "seed": 0},
    **{"corpus": "c" * 64, "recipe": {"reader": "folder"}, "package": "0", "units": "ours", "beat_sigma": 1 / 6},
    **{"feature_network": None, "feature_vectors": 0, "feature_width": None, "floor": None, "wrist_to_wrist": 1.3},
}


def cell(mean, half=0.1, best=None, **more):
    """A score with a symmetric interval."""
    return {"mean": mean, "low": mean - half, "high": mean + half, "best": best, "clips": 30, **more}


def run_row(name, cells, samples=20, **changes):
    """A row of a run."""
    run = {"model": "flow", "preset": "tiny", "steps": 300, "seed": 4, "weights": "ab" * 32, "settings": name}
    return {"name": name, "samples": samples, "scores": cells, "emotions": None, "run": run, **changes}


def report(rows, **about):
    """A report with the truth as its last row."""
    truth = {key: cell(1.0, 0.02) for key in METRICS}
    return {"about": {**ABOUT, **about}, "rows": [*rows, run_row("truth", truth, 1, run=None)], "audits": {}}


@pytest.fixture
def full():
    """All metrics, three runs, large and negative numbers."""
    rows = [run_row(f"model {n}", {key: cell(1234.5 * n - 1300.0, 33.0, 1000.0) for key in METRICS}) for n in range(3)]
    return report(rows)


def test_runs_are_described_everywhere(full):
    table = markdown(full)
    assert "| model 0 | flow | tiny | 300 | 4 | abababababababab |" in table
    assert "model 0: flow tiny, 300 steps, seed 4, weights abababababab." in latex(full)
    assert "ab" * 32 in latex(full)


def test_the_tolerance_is_in_seconds_and_old_reports_say_frames(full):
    assert "beat alignment, motion to audio, 0.17 s ≈" in markdown(full)
    assert "sigma is 0.167 s" in markdown(full)
    del full["about"]["beat_sigma"]
    assert "beat alignment, motion to audio, 5 frames ≈" in markdown(full)


class TestBold:
    def marked(self, metric, *cells):
        rows = [run_row(str(place), {metric: one}) for place, one in enumerate(cells)]
        return best_runs(report(rows), METRICS[metric])

    def test_follows_the_direction(self):
        low, high = cell(1.5), cell(3.0)
        assert self.marked("position_l1", low, high) == {0}
        assert self.marked("pck", low, high) == {1}
        # The truth is 1.
        assert self.marked("diversity", cell(0.2), cell(1.6), cell(3.0)) == {1}

    def test_intervals_that_include_the_best_are_marked_too(self):
        assert self.marked("position_l1", cell(1.5, 0.01), cell(1.7, 0.3), cell(1.7, 0.1)) == {0, 1}
        assert self.marked("diversity", cell(1.1, 0.01), cell(0.7, 0.35), cell(0.7, 0.2)) == {0, 1}

    def test_of_one_run_nothing_is_marked_nor_baselines_nor_dashes(self):
        assert self.marked("position_l1", cell(1.5)) == set()
        empty = {**cell(0.0), "mean": None, "low": None, "high": None}
        assert self.marked("position_l1", cell(2.0), empty, cell(3.0)) == {0}

    def test_is_set_and_explained(self):
        text = latex(report([run_row("a", {"pck": cell(0.9, 0.01)}), run_row("b", {"pck": cell(0.5, 0.01)})]))
        assert text.count(r"\textbf{0.900} $\pm$ 0.010") == text.count(r"\textbf") == 1
        assert "Bold: the best run of a column" in text
        assert "Bold" not in latex(report([run_row("a", {"pck": cell(0.9)})]))


class TestLatex:
    def test_every_block_is_as_wide_as_the_text_at_most(self, full):
        """By the widths of the font itself, which Matplotlib has: cmr8 is 1.0625 as wide as cmr10."""
        blocks = re.findall(r"\\begin{tabular}{@{}l(r+)@{}}\n(.*?)\\end{tabular}\n\\par", latex(full), re.DOTALL)
        assert sum(len(columns) for columns, _ in blocks) == len(METRICS)
        for columns, body in blocks:
            rows = [split_row(line) for line in body.splitlines() if " & " in line]
            widths = np.max([[true_width(one) for one in row] for row in rows], axis=0)
            assert len(widths) == len(columns) + 1
            assert sum(widths) + 6.0 * len(columns) <= TEXT_WIDTH

    def test_pages_are_not_longer_than_a_page(self, full):
        pages = latex(full).split(r"\begin{table}")[1:]
        assert len(pages) > 1
        for page in pages:
            lines = 0.0
            for block in page.split(r"\toprule")[1:]:
                head, body = block[: block.index(r"\bottomrule")].split(r"\midrule")
                stacks = re.findall(r"{@{}r@{}}(.*?)\\end", head)
                lines += body.count(r"\\") + 1.5 + max(one.count(r"\\") + 1 for one in stacks)
            caption = page[: page.index(r"\toprule")]
            assert 9.5 * lines + 12 * (len(caption) / 75 + 1) < 560

    def test_units_are_in_the_head_and_braces_match(self, full):
        text = latex(full)
        for unit in (r"cm/s $\downarrow$", r"m/s$^2$ $\downarrow$", r"m/s$^3$ $\approx$", r"degrees $\downarrow$"):
            assert unit in text, unit
        assert text.count("{") == text.count("}")
        for name in ("table", "tabular"):
            assert text.count(rf"\begin{{{name}}}") == text.count(rf"\end{{{name}}}")
        assert "best of 20" in text
        assert "$-$1300.00 $\\pm$ 33.00" in text

    def test_an_asymmetric_interval_has_brackets(self):
        one = {**cell(0.95), "low": 0.7, "high": 0.99}
        assert "0.950 [0.700, 0.990]" in latex(report([run_row("a", {"emotion_accuracy": one})]))

    @settings(max_examples=60, deadline=None)
    @given(st.text(max_size=40))
    def test_names_are_no_commands(self, name):
        """Whatever a folder is called: nothing is left that LaTeX would execute, and lines stay lines."""
        text = latex(report([run_row(name, {"pck": cell(0.5)})]))
        body = text[text.index(r"\begin{table}") :]
        for known in (r"\\", r"\&", r"\%", r"\$", r"\#", r"\_", r"\{", r"\}"):
            body = body.replace(known, "")
        commands = set(re.findall(r"\\[a-zA-Z]+", body))
        assert commands <= {
            *(rf"\{one}" for one in ("begin", "end", "centering", "footnotesize", "setlength", "tabcolsep", "caption")),
            *(
                rf"\{one}"
                for one in ("toprule", "midrule", "bottomrule", "par", "medskip", "pm", "approx", "downarrow")
            ),
            *(rf"\{one}" for one in ("uparrow", "circ", "textbackslash", "textasciitilde", "textasciicircum")),
            *(rf"\{one}" for one in ("textless", "textgreater", "textbar", "textbf")),
        }
        assert body.count("{") == body.count("}")
        assert not re.search("[%#~]", body)
        assert body.count("$") % 2 == 0
        assert all(line.startswith("% ") for line in text[: text.index(r"\begin{table}")].splitlines() if line)
        rows = [line for line in body.splitlines() if line.endswith(" ") or line.startswith("[")]
        assert not any(line.startswith(("[", "*")) for line in rows)


def split_row(line):
    """The cells of a row, each as its widest line without commands."""
    cells = [re.sub(r"\\(begin|end){tabular}(\[.\])?({@{}.@{}})?", "", one) for one in line.split(" & ")]
    return [re.split(r"\\\\", one) for one in cells]


def true_width(lines):
    """Points of the widest line in cmr8, signs of mathematics included."""
    from matplotlib.ft2font import FT2Font

    font = FT2Font(f"{matplotlib.get_data_path()}/fonts/ttf/cmr10.ttf")
    font.set_size(200.0, 72)

    def width(line):
        signs = {
            r"\$\\pm\$": "00-",
            r"\$-\$": "00",
            r"\$\^(.)\$": r"\1",
            r"\$\\\w+\$": "00",
            r"\\textbf{([^}]*)}": r"\1",
        }
        for pattern, plain in signs.items():
            line = re.sub(pattern, plain, line)
        text = line.replace("\\_", "_").strip()
        if not text:
            return 0.0
        font.set_text(text)
        return font.get_width_height()[0] / 64.0 * (8.0 / 200.0) * 1.0625 * (1.15 if "textbf" in line else 1.0)

    return max(width(line) for line in lines)


@given(st.text(alphabet=string.ascii_letters + string.digits + " .,:;()/*", min_size=1, max_size=30))
@settings(deadline=None)
def test_estimated_widths_are_not_below_the_fonts(text):
    plain = text.strip() or "x"
    assert true_width([plain]) <= latex_text.width(plain) * 1.02 + 1.0


def test_escapes():
    assert latex_text.escape("a_b & 50% #1 $x {y} ~^\\ <|>") == (
        r"a\_b \& 50\% \#1 \$x \{y\} "
        r"\textasciitilde{}\textasciicircum{}\textbackslash{} \textless{}\textbar{}\textgreater{}"
    )
    assert latex_text.escape("[1] x") == "{}[1] x"
    assert latex_text.escape("a\nb\tc\x00d") == "a b c d"
    assert latex_text.escape("--") == "-{}-"
    assert latex_text.comment("a\n\\evil") == r"% a \evil"


def test_a_bar_in_a_name_does_not_end_a_cell_of_markdown():
    text = markdown(report([run_row("a|b\nc", {"pck": cell(0.5)})]))
    assert "| a\\|b c | 20 | " in text


class TestPicture:
    def test_two_rows_of_noise_do_not_flatten_the_others(self):
        """Accelerations of the shipped report: 46 and 231 with noise, the others from 0 to 2.6."""
        assert limit_of([1.25, 0.0, 1.56, 46.35, 231.32, 2.64, 1.85, 1.13]) == 2.64
        assert limit_of([6.3, 0.0, 7.4, 2.1, 10.6, 8.0]) is None
        assert limit_of([0.0, 0.0, 0.0, 5.0]) is None

    def test_runs_keep_their_length(self):
        values = [85.9, 0.0, 2.4, 53.6, 5216.0, 6.0, 0.0, 382.8]
        assert limit_of(values) == 6.0
        assert limit_of(values, [85.9]) == 85.9
        # Among runs, one that fails apart.
        assert limit_of([1.0, 2.0, 1e5, 1.5], [1.0, 2.0, 1e5]) == 2.0

    @given(st.lists(st.floats(0.0, 1e6), min_size=1, max_size=12), st.floats(0.01, 100.0))
    def test_a_limit_does_not_depend_on_the_unit_and_leaves_half(self, values, scale):
        limit, scaled = limit_of(values), limit_of([scale * value for value in values])
        if limit is None or scaled is None:
            return
        assert scaled == pytest.approx(scale * limit)
        cut = [value for value in values if value > limit]
        assert 0 < len(cut) <= len(values) / 2
        assert min(cut) > FACTOR * limit

    def test_dashes_and_cut_bars_are_written(self, tmp_path, monkeypatch):
        """The numbers of bars beyond the panel, a dash for each missing value and interval, and why."""
        from matplotlib.axes import Axes

        written, draw = [], Axes.text
        monkeypatch.setattr(
            Axes, "text", lambda self, x, y, s, *a, **k: written.append(s) or draw(self, x, y, s, *a, **k)
        )
        few = {"low": None, "high": None, "clips": 2, "reason": "2 recordings: an interval needs 5 or more"}
        none = {"mean": None, **few, "best": None, "vectors": 9, "features": 9, "reason": "9 vectors"}
        rows = [
            run_row("a", {"pck": cell(0.5), "fgd": none, "jerk": cell(10.0)}),
            run_row("b$", {"pck": {**cell(0.6), **few}, "fgd": none, "jerk": cell(12.0)}),
            run_row("truth, 5 degrees of noise", {"jerk": cell(21723.0)}, 1, run=None),
        ]
        paths = write_report(report(rows), tmp_path / "report")
        assert {path.suffix for path in paths} == {".json", ".md", ".tex", ".png"}
        assert "21723" in written
        assert written.count(" [-]") == 1
        assert written.count("-") >= 2
        assert "null" in (tmp_path / "report" / "report.json").read_text()


@pytest.mark.parametrize(
    "change",
    [
        lambda report: report["about"].pop("split"),
        lambda report: report["about"].update(clips="3"),
        lambda report: report["about"].update(feature_network=3),
        lambda report: report["rows"].append(1),
        lambda report: report["rows"][0].pop("name"),
        lambda report: next(iter(report["rows"][0]["scores"].values())).update(mean="7"),
        lambda report: next(iter(report["rows"][0]["scores"].values())).pop("low"),
    ],
)
def test_a_file_that_is_no_report_is_one_error(full, tmp_path, change):
    text = json.dumps(full)
    (tmp_path / "report.json").write_text(text)
    assert read_report(tmp_path) == json.loads(text)
    report = json.loads(text)
    change(report)
    (tmp_path / "report.json").write_text(json.dumps(report))
    with pytest.raises(InputError, match="is not a report of 'a2g evaluate'"):
        read_report(tmp_path)
