//! Rendering of our own SVG as pixels, with a bundled font for identical pictures on every machine.

use std::io;
use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

/// Font `DejaVu` Sans reduced to the scripts expected in file and foot names; its licence is in the same directory.
const FONT: &[u8] = include_bytes!("font/DejaVuSans-latin-greek-cyrillic.ttf");

/// Family name of the font.
const FAMILY: &str = "DejaVu Sans";

/// Renders an SVG in its own size, as PNG.
///
/// # Errors
/// The SVG is invalid or too large for the memory.
pub fn png(svg: &str) -> io::Result<Vec<u8>> {
    let mut fonts = Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family(FAMILY);
    let options = Options {
        font_family: FAMILY.to_owned(),
        fontdb: Arc::new(fonts),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options).map_err(io::Error::other)?;
    let size = tree.size().to_int_size();
    let mut pixels = Pixmap::new(size.width(), size.height())
        .ok_or_else(|| io::Error::other("the picture is too large"))?;
    resvg::render(&tree, Transform::identity(), &mut pixels.as_mut());
    pixels.encode_png().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of pixels darker than paper.
    fn ink(png: &[u8]) -> usize {
        let picture = Pixmap::decode_png(png).unwrap();
        let dark = |pixel: &&resvg::tiny_skia::PremultipliedColorU8| pixel.green() < 128;
        picture.pixels().iter().filter(dark).count()
    }

    fn text(said: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"400\" height=\"60\">\
             <rect width=\"400\" height=\"60\" fill=\"#FFFFFF\"/>\
             <text x=\"10\" y=\"40\" font-family=\"sans-serif\" font-size=\"24\" fill=\"#000000\">{said}</text>\
             </svg>"
        )
    }

    #[test]
    fn text_is_drawn_with_the_bundled_font() {
        assert_eq!(ink(&png(&text("")).unwrap()), 0);
        let few = ink(&png(&text("P")).unwrap());
        let many = ink(&png(&text("P stable, 9.81 m/s² · ΔΩ – Größe")).unwrap());
        assert!(few > 50 && many > 10 * few, "{few}, {many}");
    }

    #[test]
    fn invalid_svg_is_rejected() {
        assert!(png("<html></html>").is_err());
    }
}
