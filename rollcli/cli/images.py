"""`rollcli derotate`, `disparity`, `vdisparity` and `heights`: each frame becomes files."""

from rollcli.cli import options as shared
from rollcli.cli.command import command, option
from rollcli.cli.types import DIR, FLAG, RESULT, Choice, Number
from rollcli.run import options as records


def _converted(options: records.ConvertOptions) -> int:
    from rollcli.run.convert import run_conversion

    return run_conversion(options)


@command(records.DerotateOptions)
@shared.input_options
@option("--roll", Number("DEG", at_least=-180, at_most=180), section="Angle")
@option("--from", RESULT, section="Angle")
@option("--skip-suspect", FLAG, section="Angle")
@option("--expand", FLAG, section="Angle")
@option("--save-matrix", FLAG, section="Angle")
@shared.output_folder_option
@shared.encoding_options
@shared.cluster_options
def derotate(options: records.DerotateOptions) -> int:
    """Rotate disparity maps about their centre by their roll, so that rows of the road become constant.

    INPUTS are maps (PNG, TIFF, NPY, NPZ, PFM, EXR), folders, .zip and .tar of them, quoted patterns, or - for
    paths on stdin. A map keeps its type, encoding and format. Values are interpolated between valid pixels
    alone, and what is no data stays no data. With the matrix M of --save-matrix, what the camera K showed at
    K X is at M K X.

    With --from, every map needs its row and every row with an angle its map: what has no partner is an error
    that names it, before anything is written. Suspect angles are used, and a line says how many there are;
    --skip-suspect leaves their maps out.

    Examples
    --------
    The angles that estimate found
        rollcli derotate maps/ --from rolls.csv -o upright/
    One angle for all, nothing cut off
        rollcli derotate maps/ --roll 2.5 --expand -o upright/
    """
    return _converted(options)


@command(records.DisparityOptions)
@shared.pair_input_options
@shared.pair_options
@shared.topic_options
@shared.output_folder_option
@shared.save_as_option
@option("--preview", DIR, section="Output")
@shared.stereo_options
@shared.calibration_options
@shared.cluster_options
def disparity(options: records.DisparityOptions) -> int:
    """Match rectified stereo pairs with OpenCV SGBM: one disparity map a pair, named after the left image.

    Images are PNG, JPEG, TIFF, BMP, PGM or PPM, of 8 or 16 bits, grey or colour. An image without a partner
    is an error that names it, before anything runs. INPUTS are images or videos that hold both views
    (--side-by-side), or bags (--left-topic, --right-topic). With a calibration, a right camera that is turned
    turns its columns about the principal point, else about the middle.

    Examples
    --------
    A folder of pairs
        rollcli disparity --left cam/left --right cam/right -o maps/
    At half the size, as floating-point TIFF
        rollcli disparity --left 'im0*.png' --right 'im1*.png' --downscale 2 --save-as tiff -o maps/
    A video that holds both views
        rollcli disparity drive.mp4 --side-by-side -o maps/
    """
    return _converted(options)


@command(records.VDisparityOptions)
@shared.input_options
@option("--bins", Number("N", at_least=1, at_most=65535, whole=True), section="Counting")
@option("--max-disparity", Number("PX", above=0), section="Counting")
@option("--counts", FLAG, section="Counting")
@option("--figure", Choice("svg", "pdf", "png"), section="Counting")
@option("--from", RESULT, section="Counting")
@shared.output_folder_option
@shared.encoding_options
@shared.calibration_options
@shared.cluster_options
def vdisparity(options: records.VDisparityOptions) -> int:
    """Draw the v-disparity image of each map: the histogram of each row's disparities.

    INPUTS are maps (PNG, TIFF, NPY, NPZ, PFM, EXR), folders, .zip and .tar of them, quoted patterns, or - for
    paths on stdin. The picture is an 8-bit PNG on a log scale; its first rows are those of the map. The map
    is taken as it is, whereas `estimate --vdisparity` rotates it upright first. Where a road is found whose
    angle is not suspect, its disparity along the middle column is drawn as a dashed curve: on a de-rotated
    map the road's pixels lie on it. With a calibration, the road's horizon on that column is drawn, too.
    --figure needs the extra: pip install "rollcli[report]".

    Examples
    --------
    Pictures to look at
        rollcli vdisparity maps/ -o vdisparity/
    Counts to compute with
        rollcli vdisparity maps/ --counts --max-disparity 128 -o vdisparity/
    A figure for a paper
        rollcli vdisparity maps/7.png --figure pdf --from rolls.csv -o figures/
    """
    return _converted(options)


@command(records.HeightsOptions)
@shared.input_options
@option("--from", RESULT, required=True, section="Road")
@option("--skip-suspect", FLAG, section="Road")
@shared.output_folder_option
@option("--preview", DIR, section="Output")
@shared.heights_range_option
@option("--save-as", Choice("tiff", "npy"), section="Output")
@shared.encoding_options
@shared.calibration_options
@shared.cluster_options
def heights(options: records.HeightsOptions) -> int:
    """Write how high each pixel of disparity maps lies over the road.

    INPUTS are maps (PNG, TIFF, NPY, NPZ, PFM, EXR), folders, .zip and .tar of them, quoted patterns, or - for
    paths on stdin. Heights are along the road's normal, over the parabola, roll and camber that RESULT has
    for each map; positive: above the road; NaN: no disparity. They are metres with a calibration that has a
    baseline, else camera heights.

    Every map needs its row and every row with an angle its map: what has no partner is an error that names
    it, before anything is written. Suspect angles are used, and a line says how many there are;
    --skip-suspect leaves their maps out.

    Examples
    --------
    Heights in metres over the roads that estimate found, with pictures
        rollcli estimate maps/ --calib calib.txt -o rolls.csv
        rollcli heights maps/ --from rolls.csv --calib calib.txt -o heights/ --preview pictures/
    At once, of stereo pairs too
        rollcli estimate maps/ -o rolls.csv --heights heights/
    """
    return _converted(options)
