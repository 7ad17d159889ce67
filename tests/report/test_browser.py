"""The page as a browser shows it."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.page_picture import PICTURE, SHOWN, WIDTH, photograph
from tests.report.results import OF_ONE_KIND, row, write_result
from tests.run_cli import road_map, rollcli, write_kitti, write_maps

pytestmark = pytest.mark.slow
pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
pytest.importorskip("jinja2", reason="jinja2, of the extra report, is not here")

NAME = "maps/<script>alert(1)</script>.png"
# what is asked of the page, by its name
IN_PAGE = {path.stem: path.read_text("utf-8") for path in Path(__file__).with_name("in_page").iterdir()}
NEVER_IDLE = "window.requestIdleCallback = () => {}"  # charts wait until the browser is idle


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    write_maps(folder / "maps", 12)
    write_kitti(folder / NAME, road_map(0.02, width=480))
    (folder / "maps" / "frame5.png").write_bytes(b"")
    rollcli("estimate", "maps", "--recursive", "-o", "rolls.csv", "--max-roll", "5", cwd=folder)
    assert rollcli("report", "rolls.csv", "-o", "page.html", cwd=folder).status == 0
    return (folder / "page.html").as_uri()


def waiting_for_a_chart(open_page, default):
    """Opens the page, or another, and waits for its first chart; the others are drawn after it.

    Drawing takes most of the time: what has nothing to do with charts sees the page before any is drawn.
    """

    def opened_page(url=default, drawn=True, **how):
        page = open_page(url, script="" if drawn else NEVER_IDLE, **how)
        if drawn:
            page.wait_for_selector("#roll .main-svg")
        return page

    return opened_page


@pytest.fixture
def opened(open_page, url):
    """Opens a page of the test's own."""
    return waiting_for_a_chart(open_page, url)


@pytest.fixture
def seen(open_page_once, url):
    """Opens the page for several tests, which only look at it."""
    opened_page = waiting_for_a_chart(open_page_once, url)
    return lambda width=1280, scheme="light": opened_page(width=width, scheme=scheme)


def page_of(folder, rows, frames_shown=0):
    """The address of the page of a result with these rows."""
    write_result(folder / "rolls.csv", rows)
    gallery = ("--gallery", str(frames_shown))
    assert rollcli("report", "rolls.csv", "-o", "page.html", *gallery, cwd=folder).status == 0
    return (folder / "page.html").as_uri()


def luminance(colour):
    """Relative luminance of a CSS colour, as WCAG 2 has it."""
    parts = [int(part) / 255 for part in re.findall(r"\d+", colour)[:3]]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def style(page, selector, name):
    return page.locator(selector).first.evaluate(f"element => getComputedStyle(element).{name}")


def test_the_charts_are_there(seen):
    page = seen()
    assert page.title() == "Roll of 13 frames"
    page.locator("#roll .scatterlayer .trace").nth(2).wait_for(state="attached")
    page.locator("#histogram .bars .point").nth(4).wait_for(state="attached")
    legend = page.locator("#roll .legendtext").all_text_contents()
    assert [text for text in ("95 % interval", "roll", "failed") if text not in legend] == []


@pytest.mark.parametrize("rows", OF_ONE_KIND)
def test_a_result_of_one_kind_of_frame_has_a_page_without_complaint(opened, tmp_path, rows):
    page = opened(url=page_of(tmp_path, rows))
    assert page.locator("#roll .legendtext").count() >= 1


def test_hovering_shows_the_name_of_the_frame_as_text(seen):
    page = seen()
    for name in ("maps/frame3.png", "maps/frame5.png", NAME):
        x, y = page.evaluate(IN_PAGE["place"], name)
        page.mouse.move(x + 1, y + 1)
        label = page.locator("#roll .hovertext", has_text=name)
        label.wait_for()
        status = "failedis empty" if name == "maps/frame5.png" else "°"
        assert label.text_content().replace(name, "", 1).endswith(status)


def test_a_click_enlarges_and_keys_move_on_and_close(opened):
    page = opened(drawn=False)
    button = page.locator(".pictures .picture.before").nth(1)
    small = button.locator("img").bounding_box()
    # a frame of another result may have the same name
    button.evaluate("it => it.dataset.caption = document.querySelector('.picture.before').dataset.caption")
    button.click()
    dialog = page.locator("dialog")
    assert dialog.is_visible()
    large = dialog.locator("img")
    assert large.get_attribute("src") == button.locator("img").get_attribute("src")
    assert large.bounding_box()["height"] > 1.5 * small["height"]
    assert large.evaluate("image => image.complete && image.naturalWidth > 0")
    caption = dialog.locator("p").inner_text()
    page.keyboard.press("ArrowRight")
    assert dialog.locator("p").inner_text() != caption
    page.keyboard.press("ArrowLeft")
    assert dialog.locator("p").inner_text() == caption
    page.keyboard.press("Escape")
    assert not dialog.is_visible()
    assert page.evaluate("document.activeElement.dataset.caption") == caption


def test_the_keyboard_alone_opens_a_picture_and_its_buttons_are_named(opened):
    page = opened(drawn=False)
    page.locator(".pictures .picture").first.focus()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Next picture").click()
    page.get_by_role("button", name="Close").click()
    assert not page.locator("dialog").is_visible()
    names = page.locator(".pictures .picture").evaluate_all("all => all.map(each => each.ariaLabel)")
    assert all(name.startswith("Enlarge: ") for name in names)
    assert len(set(names)) == len(names) == 5 * 12


def test_a_switch_shows_a_frame_before_and_after_and_the_table_shows_its_pictures_too(opened):
    page = opened(drawn=False)
    page.locator(".rows .row", has_text="alert").click()
    for box in (page.locator("figure .pictures").first, page.locator(".detail .pictures")):
        before, after = box.locator(".picture.before"), box.locator(".picture.after")
        assert [each.is_visible() for each in (before.first, after.first)] == [True, False]
        assert before.last.bounding_box()["width"] > 300  # a v-disparity that can be read
        box.get_by_role("button", name="de-rotated by").first.click()
        assert [each.is_visible() for each in (before.first, after.first)] == [False, True]
        assert box.locator(".switch [aria-pressed=true]").inner_text().startswith("de-rotated by")
    page.locator(".detail .picture.after").first.click()
    assert page.locator("dialog p").inner_text().startswith(NAME)


def test_one_switch_turns_all_frames_on_a_narrow_screen_with_its_captions(opened):
    page = opened(width=400, drawn=False)
    for name, kind, caption in (
        ("all before", "before", "Map"),
        ("all de-rotated", "after", "Map, de-rotated by +1.146°"),
        ("all heights", "heights", "Heights over the road"),
    ):
        button = page.get_by_role("button", name=name)
        button.click()
        assert button.get_attribute("aria-pressed") == "true"
        assert page.locator(".switch-all [aria-pressed=true]").count() == 1
        cards = page.locator(".gallery .pictures").all()
        assert len(cards) == 12
        for card in cards:
            assert all(card.locator(f".{kind}").evaluate_all("all => all.map(e => e.checkVisibility())"))
        assert cards[0].locator(f".{kind} span").first.inner_text() == caption
    assert page.evaluate("document.documentElement.scrollHeight") < 10_000


def test_an_enlarged_wide_map_leaves_no_empty_space_and_the_buttons_stay_where_they_are(opened):
    page = opened(drawn=False)
    page.locator(f".pictures .picture[data-caption='{NAME}: map']").click()
    shown, next_one = page.locator("dialog img"), page.get_by_role("button", name="Next picture")
    image, place = shown.bounding_box(), next_one.bounding_box()
    assert image["width"] / image["height"] == pytest.approx(4, rel=0.01)
    assert page.locator("dialog").bounding_box()["height"] - image["height"] < 100
    next_one.click(click_count=3)  # past the level map and the heights to a v-disparity
    assert shown.bounding_box()["height"] > image["height"]
    assert next_one.bounding_box() == place


def test_on_a_narrow_screen_a_wide_map_is_enlarged_beyond_the_screen_and_is_moved_about(opened):
    page = opened(width=400, drawn=False)
    button = page.locator(".pictures .picture").first
    small = button.locator("img").bounding_box()
    button.click()
    large = page.locator("dialog img").bounding_box()
    assert large["height"] > 2 * small["height"]
    assert large["width"] / large["height"] == pytest.approx(4 / 3, rel=0.01)
    assert page.evaluate("document.querySelector('dialog div').scrollLeft") > 0


@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_is_cut_off_or_too_small_to_read(seen, width):
    page = seen(width=width)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.evaluate(IN_PAGE["too_wide"]) == []
    sizes = page.evaluate(IN_PAGE["font_sizes"])
    assert min(sizes)[0] >= 11, min(sizes)


def test_on_a_narrow_screen_no_value_is_hidden(seen):
    page = seen(width=400)
    assert page.locator(".reasons td").count() >= 5
    hidden = page.locator(".reasons td, .rows .row > span, .figures td, .options span").evaluate_all(
        "all => all.filter(e => e.textContent && !e.getClientRects().length).map(e => e.className)"
    )
    assert hidden == []


def test_a_printed_page_shows_both_sides_of_the_switch_and_keeps_headings_with_what_follows(opened, tmp_path):
    page = opened()
    page.emulate_media(media="print")
    shown = page.locator("figure .picture").evaluate_all(
        "all => all.every(each => each.getClientRects().length)"
    )
    assert shown
    assert page.locator(".switch").first.is_hidden()

    reason = "the interval is wide, and few rows have the road's edge; " * 3
    rows = [
        row(f"drives/a_long_name_of_a_day/image_2/{i:06}.png", 1.0, 1.5, "suspect", reason) for i in range(40)
    ]
    for each in (page, opened(url=page_of(tmp_path, rows))):
        each.emulate_media(media="print")
        each.evaluate(IN_PAGE["columns"])
        assert each.evaluate("document.querySelector('main').scrollWidth") > 1500  # several pages
        assert each.evaluate(IN_PAGE["torn"]) == []


def test_a_hundred_and_twenty_frames_are_a_sheet_of_answer_and_six_of_pictures(opened, tmp_path):
    write_kitti(tmp_path / "map.png", road_map(0.02, width=480))
    rolls = np.random.default_rng(2).normal(1.1, 0.2, 120)
    found = [replace(row("map.png", roll), width=480) for roll in rolls.tolist()]
    url = page_of(tmp_path, found, frames_shown=120)
    page = opened(url=url, scheme="dark")
    assert len(re.findall(rb"/Type /Page\b", page.pdf(format="A4"))) <= 7

    page.emulate_media(media="print")
    page.set_viewport_size({"width": 703, "height": 1032})  # a sheet within its margins
    assert luminance(style(page, "section", "backgroundColor")) > 0.9
    last = page.locator(".side-by-side").first.bounding_box()
    assert last["y"] + last["height"] < 1032
    charts = page.locator(".chart")
    assert charts.count() == 2
    for chart in charts.all():
        still = chart.locator(".still:visible")
        assert still.count() == 1
        assert chart.bounding_box()["height"] == pytest.approx(still.bounding_box()["height"], abs=1)
        assert not chart.locator(".modebar").first.is_visible()
    tops = [each.bounding_box()["y"] for each in page.locator(".gallery figure").all()[:8]]
    assert len(set(tops)) == 2


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_in_light_and_dark_mode(seen, scheme):
    page = seen(scheme=scheme)
    ground, card = style(page, "body", "backgroundColor"), style(page, "section", "backgroundColor")
    assert (luminance(card) < 0.05) == (scheme == "dark")
    assert contrast(style(page, "h1", "color"), ground) > 7
    texts = ("td", ".note", "figure p", ".picture span", ".pill.suspect", ".pill.error", ".options span")
    for selector in texts:
        assert contrast(style(page, selector, "color"), card) > 4.5, selector
    for selector in ("#roll .xtick text", "#roll .legendtext", "#histogram .ytick text"):
        assert contrast(style(page, selector, "fill"), card) > 7, selector


def test_a_script_that_is_not_the_pages_own_does_not_run(opened, tmp_path, url):
    text = Path(url.removeprefix("file://")).read_text("utf-8")
    (tmp_path / "page.html").write_text(
        text.replace("</main>", "<script>window.ran = 1</script></main>"), "utf-8"
    )
    refused = []
    page = opened(url=(tmp_path / "page.html").as_uri(), expected=refused, drawn=False)
    assert page.evaluate("window.ran") is None
    assert ["script-src" in message for message in refused] == [True]


@pytest.fixture(scope="module")
def long_url(tmp_path_factory):
    """The page of 10,000 frames, of which every fiftieth is suspect."""
    folder = tmp_path_factory.mktemp("long")
    kinds = [("suspect", "<b>wide</b>"), *[("ok", "")] * 49]
    rolls = [i * 7919 % 10_000 / 1000 for i in range(10_000)]
    rows = [row(f"maps/f{i:05}.png", roll, 0.05, *kinds[i % 50]) for i, roll in enumerate(rolls)]
    return page_of(folder, rows)


def shown_rows(page):
    """Number, name, status and roll of each row in the document, from above."""
    return [
        [cell.strip() for cell in cells][:4]
        for cells in page.locator(".rows .row").evaluate_all(
            "all => all.map(each => [...each.children].map(cell => cell.textContent))"
        )
    ]


def test_a_table_of_ten_thousand_frames_holds_the_rows_in_view_alone_and_is_sorted_and_searched(
    opened, long_url
):
    page = opened(url=long_url, drawn=False)
    assert shown_rows(page)[0][:2] == ["1", "maps/f00000.png"]
    assert len(shown_rows(page)) < 50

    page.get_by_role("button", name="roll", exact=True).click()
    rolls = [float(line[3].split("±")[0]) for line in shown_rows(page)]
    assert rolls == sorted(rolls)
    assert rolls[0] == 0
    page.get_by_role("button", name="roll", exact=True).click()
    assert shown_rows(page)[0][3] == "+10.00 ± 0.05°"

    page.get_by_role("searchbox").fill("WIDE f001")
    assert page.locator(".count").inner_text() == "2 of 10,000"
    assert {line[1] for line in shown_rows(page)} == {"maps/f00100.png", "maps/f00150.png"}

    page.get_by_role("searchbox").fill("")
    page.get_by_role("button", name="#", exact=True).click()
    page.locator(".rows").evaluate("box => { box.scrollTop = box.scrollHeight; }")
    page.get_by_text("maps/f09999.png").wait_for()
    assert len(shown_rows(page)) < 50


def test_an_address_leads_to_a_frame_whatever_it_is_called(opened, url, long_url):
    page = opened(url=long_url + "#frame=maps/f07750.png", drawn=False)
    assert page.locator(".detail h3").inner_text() == "maps/f07750.png"
    assert "<b>wide</b>" in page.locator(".detail").inner_text()
    assert page.locator(".rows [aria-current]").is_visible()

    page = opened(drawn=False)
    page.locator(".rows .row", has_text="alert").click()
    assert page.locator(".detail h3").inner_text() == NAME
    assert page.locator(".detail img").count() == 5
    again = opened(url=page.url, drawn=False)
    assert again.locator(".detail h3").inner_text() == NAME
    assert opened(url=url + "#frame=%E0%A4%A", drawn=False).locator(".detail").is_hidden()


def test_a_click_on_a_point_of_the_chart_leads_to_its_row_and_pictures(opened):
    page = opened()
    for name in ("maps/frame3.png", "maps/frame5.png"):
        page.locator("#roll").scroll_into_view_if_needed()
        x, y = page.evaluate(IN_PAGE["place"], name)
        page.mouse.move(x + 1, y + 1)
        page.locator("#roll .hovertext", has_text=name).wait_for()
        page.mouse.click(x + 1, y + 1)
        page.locator(".detail h3", has_text=name).wait_for()
        assert (page.locator(".detail img").count() == 5) == (name == "maps/frame3.png")
        assert page.locator(".rows [aria-current]").is_visible()
    assert page.locator(".detail").inner_text().endswith("is empty")  # no gallery has what has no angle


def test_the_readmes_picture_of_the_page_is_of_the_parts_it_names(browser, url):
    page = Path(url.removeprefix("file://"))
    assert [each for each in SHOWN if f"<h2>{each}</h2>" not in page.read_text("utf-8")] == []
    pixels = cv2.imdecode(np.frombuffer(photograph(browser, page), np.uint8), cv2.IMREAD_COLOR)
    assert pixels.shape[1] == WIDTH
    assert 1200 < pixels.shape[0] < 2400  # without tables and lists, and of one frame
    committed = cv2.imread(str(PICTURE))
    assert committed.shape[1] == WIDTH
    assert PICTURE.stat().st_size < 300_000


def test_charts_follow_when_the_mode_changes(opened):
    page = opened(scheme="light")
    before = style(page, "#roll .xtick text", "fill")
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(
        "before => getComputedStyle(document.querySelector('#roll .xtick text')).fill !== before", arg=before
    )
    assert contrast(style(page, "#roll .xtick text", "fill"), style(page, "section", "backgroundColor")) > 7


def test_the_chart_offers_nothing_that_leaves_this_computer(seen):
    titles = seen().locator(".modebar-btn").evaluate_all("all => all.map(each => each.dataset.title)")
    assert titles
    assert not [title for title in titles if re.search("share|cloud|plotly|edit", title, re.I)]
