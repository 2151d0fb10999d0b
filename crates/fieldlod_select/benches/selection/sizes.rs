//! Cost against the size of the scene, as a table and as a picture.

use std::fmt::Write;
use std::path::Path;

/// What a frame costs in a scene of some size, in microseconds.
pub(crate) struct Size {
    pub(crate) instances: u32,
    pub(crate) scratch_us: f64,
    pub(crate) walking_us: f64,
    /// The baseline's scan of all groups.
    pub(crate) scan_us: f64,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
const MARGIN: f64 = 64.0;
/// Powers of ten that the axes reach over: instances, and microseconds.
const X_DECADES: (i32, i32) = (0, 5);
const Y_DECADES: (i32, i32) = (-2, 4);

/// Writes the picture that stands beside the record, if the environment asks for it.
pub(crate) fn write_if_asked(sizes: &[Size]) {
    if let Some(path) = std::env::var_os("FIELDLOD_SIZES_SVG") {
        let written = std::fs::write(Path::new(&path), svg(sizes));
        written.unwrap_or_else(|error| panic!("{}: {error}", Path::new(&path).display()));
    }
}

fn svg(sizes: &[Size]) -> String {
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
    );
    for decade in X_DECADES.0..=X_DECADES.1 {
        let x = x_of(10f64.powi(decade));
        line(&mut svg, (x, MARGIN), (x, HEIGHT - MARGIN), "#ddd", 1.0);
        text(
            &mut svg,
            (x, HEIGHT - MARGIN + 20.0),
            "middle",
            &format!("{}", 10u32.pow(decade as u32)),
        );
    }
    for decade in Y_DECADES.0..=Y_DECADES.1 {
        let y = y_of(10f64.powi(decade));
        line(&mut svg, (MARGIN, y), (WIDTH - MARGIN, y), "#ddd", 1.0);
        text(
            &mut svg,
            (MARGIN - 8.0, y + 4.0),
            "end",
            &format!("{}", 10f64.powi(decade)),
        );
    }
    text(
        &mut svg,
        (WIDTH / 2.0, HEIGHT - 16.0),
        "middle",
        "instances in the scene; the picture stays the same",
    );
    text(
        &mut svg,
        (MARGIN, MARGIN - 24.0),
        "start",
        "microseconds a frame, one thread",
    );
    let curves: [(&str, &str, fn(&Size) -> f64); 3] = [
        ("scan of all groups (clusterlod's test)", "#999", |size| {
            size.scan_us
        }),
        ("from scratch", "#d95f02", |size| size.scratch_us),
        ("walking", "#1b9e77", |size| size.walking_us),
    ];
    for (row, (name, color, value)) in (0u8..).zip(curves) {
        let points: Vec<(f64, f64)> = sizes
            .iter()
            .map(|size| (x_of(f64::from(size.instances)), y_of(value(size))))
            .collect();
        for pair in points.windows(2) {
            line(&mut svg, pair[0], pair[1], color, 2.5);
        }
        let y = MARGIN + 16.0 + 20.0 * f64::from(row);
        line(&mut svg, (MARGIN + 12.0, y), (MARGIN + 36.0, y), color, 3.0);
        text(&mut svg, (MARGIN + 44.0, y + 4.0), "start", name);
    }
    svg.push_str("</svg>\n");
    svg
}

fn x_of(instances: f64) -> f64 {
    along(instances, X_DECADES, MARGIN, WIDTH - MARGIN)
}

fn y_of(microseconds: f64) -> f64 {
    along(microseconds, Y_DECADES, HEIGHT - MARGIN, MARGIN)
}

fn along(value: f64, (first, last): (i32, i32), from: f64, to: f64) -> f64 {
    let share = (value.log10() - f64::from(first)) / f64::from(last - first);
    from + share * (to - from)
}

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), color: &str, width: f64) {
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{color}\" stroke-width=\"{width}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn text(svg: &mut String, at: (f64, f64), anchor: &str, text: &str) {
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{text}</text>",
        at.0, at.1
    );
}
