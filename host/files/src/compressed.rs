//! Files compressed with gzip or zstd, recognised by their first bytes.

use std::error::Error;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

use flate2::bufread::GzDecoder;
use ruzstd::decoding::StreamingDecoder;

/// The first bytes of a gzip member, whose only method is deflate (RFC 1952, section 2.3.1).
const GZIP: [u8; 3] = [0x1f, 0x8b, 0x08];

/// The first bytes of a zstd frame (RFC 8878, section 3.1.1).
pub const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Endings of the names of compressed files.
const ENDINGS: [&str; 3] = ["gz", "zst", "zstd"];

/// Path without the ending of a compressed file.
#[must_use]
pub fn without_ending(path: &Path) -> &Path {
    let is_ending = |extension: &OsStr| ENDINGS.iter().any(|known| extension == *known);
    if path.extension().is_some_and(is_ending) {
        Path::new(path.file_stem().unwrap_or_default())
    } else {
        path
    }
}

/// Content of a file, decompressed if necessary.
///
/// # Errors
/// The file cannot be read, or the first zstd frame is invalid.
pub fn decompressed(mut file: Box<dyn Read>) -> io::Result<Box<dyn Read>> {
    let mut first = Vec::new();
    file.by_ref().take(ZSTD.len() as u64).read_to_end(&mut first)?;
    let is_gzip = first.starts_with(&GZIP);
    let is_zstd = first == ZSTD;
    let whole: Box<dyn Read> = Box::new(Cursor::new(first).chain(file));
    Ok(if is_gzip {
        Box::new(Members { decoder: Some(GzDecoder::new(BufReader::new(whole))) })
    } else if is_zstd {
        Box::new(Frames { decoder: Some(decoder(Box::new(BufReader::new(whole)))?) })
    } else {
        whole
    })
}

/// The consecutive members of a gzip file, which zeros may follow: a tape or a loss of power pads a file with them.
struct Members {
    /// `None` after the last member.
    decoder: Option<GzDecoder<BufReader<Box<dyn Read>>>>,
}

impl Read for Members {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if to.is_empty() {
            return Ok(0);
        }
        while let Some(member) = &mut self.decoder {
            let count = member.read(to)?;
            if count > 0 {
                return Ok(count);
            }
            let Some(finished) = self.decoder.take() else {
                break;
            };
            let mut source = finished.into_inner();
            match first_beyond_zeros(&mut source)? {
                None => {}
                Some(first) if first == GZIP[0] => self.decoder = Some(GzDecoder::new(source)),
                Some(_) => {
                    let other = "other data follow the gzip data";
                    return Err(io::Error::new(io::ErrorKind::InvalidData, other));
                }
            }
        }
        Ok(0)
    }
}

/// Skips zeros, and returns the byte after them without consuming it.
fn first_beyond_zeros(source: &mut impl BufRead) -> io::Result<Option<u8>> {
    loop {
        let bytes = source.fill_buf()?;
        let first = bytes.iter().find(|byte| **byte != 0).copied();
        let zeros = bytes.iter().take_while(|byte| **byte == 0).count();
        let is_end = bytes.is_empty();
        source.consume(zeros);
        if first.is_some() || is_end {
            return Ok(first);
        }
    }
}

type FrameReader = StreamingDecoder<Box<dyn Read>, ruzstd::decoding::FrameDecoder>;

fn decoder(source: Box<dyn Read>) -> io::Result<FrameReader> {
    StreamingDecoder::new(source).map_err(|error| zstd_error(&io::Error::other(error)))
}

/// Returns an error of a zstd frame in words: whether the file ends early, or is damaged.
fn zstd_error(error: &io::Error) -> io::Error {
    let mut cause: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(next) = cause {
        let inner = next.downcast_ref::<io::Error>();
        if inner.is_some_and(|inner| inner.kind() == io::ErrorKind::UnexpectedEof) {
            let early = "the zstd data end early; zstd -dc writes the complete blocks before that";
            return io::Error::new(io::ErrorKind::InvalidData, early);
        }
        // If an `io::Error` wraps another error, `source` skips the wrapped error.
        cause = match inner.and_then(io::Error::get_ref) {
            Some(content) => Some(content),
            None => next.source(),
        };
    }
    io::Error::new(io::ErrorKind::InvalidData, format!("the zstd data are damaged: {error}"))
}

/// The consecutive frames of a zstd file, which has several if data were appended to it.
struct Frames {
    /// `None` after the last frame.
    decoder: Option<FrameReader>,
}

impl Read for Frames {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if to.is_empty() {
            return Ok(0);
        }
        while let Some(frame) = &mut self.decoder {
            let count = frame.read(to).map_err(|error| zstd_error(&error))?;
            if count > 0 {
                return Ok(count);
            }
            let Some(finished) = self.decoder.take() else {
                break;
            };
            let (mut source, frame) = finished.into_parts();
            let sums = (frame.get_checksum_from_data(), frame.get_calculated_checksum());
            if let (Some(stored), Some(computed)) = sums
                && stored != computed
            {
                let damaged = "the data are damaged: their checksum is wrong";
                return Err(io::Error::new(io::ErrorKind::InvalidData, damaged));
            }
            let mut next = Vec::new();
            source.by_ref().take(1).read_to_end(&mut next)?;
            if !next.is_empty() {
                self.decoder = Some(decoder(Box::new(Cursor::new(next).chain(source)))?);
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    /// `t,ax\n` by zstd 1.5.
    const T_AX: &[u8] = &[
        0x28, 0xb5, 0x2f, 0xfd, 0x04, 0x58, 0x29, 0x00, 0x00, 0x74, 0x2c, 0x61, 0x78, 0x0a, 0x9d,
        0x64, 0xb4, 0x32,
    ];

    fn read(bytes: &[u8]) -> io::Result<String> {
        let mut text = String::new();
        decompressed(Box::new(Cursor::new(bytes.to_vec())))?.read_to_string(&mut text)?;
        Ok(text)
    }

    fn gzip(text: &str) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn plain_text_of_any_length_is_unchanged() {
        for text in ["", "t", "t,ax,ay\n"] {
            assert_eq!(read(text.as_bytes()).unwrap(), text);
        }
    }

    #[test]
    fn concatenated_gzip_files_are_read() {
        assert_eq!(read(&gzip("t,ax\n")).unwrap(), "t,ax\n");
        let two = [gzip("t,ax\n"), gzip("0,1\n")].concat();
        assert_eq!(read(&two).unwrap(), "t,ax\n0,1\n");
    }

    #[test]
    fn zeros_after_gzip_data_are_skipped() {
        let zeros = vec![0; 100_000];
        assert_eq!(read(&[gzip("t,ax\n"), zeros.clone()].concat()).unwrap(), "t,ax\n");
        let padded = [gzip("t,ax\n"), zeros, gzip("0,1\n")].concat();
        assert_eq!(read(&padded).unwrap(), "t,ax\n0,1\n");
        let other = read(&[gzip("t,ax\n"), b"0,1\n".to_vec()].concat()).unwrap_err();
        assert_eq!(other.to_string(), "other data follow the gzip data");
    }

    #[test]
    fn concatenated_zstd_files_are_read() {
        assert_eq!(read(T_AX).unwrap(), "t,ax\n");
        assert_eq!(read(&[T_AX, T_AX].concat()).unwrap(), "t,ax\nt,ax\n");
    }

    #[test]
    fn truncated_or_damaged_compressed_file_is_an_error() {
        let gzip = gzip("t,ax\n");
        assert!(read(&gzip[..gzip.len() - 4]).is_err());
        for length in ZSTD.len()..T_AX.len() {
            let early = read(&T_AX[..length]).unwrap_err().to_string();
            assert!(early.starts_with("the zstd data end early"), "{length}: {early}");
        }
        let mut damaged = T_AX.to_vec();
        damaged[12] ^= 1;
        assert!(read(&damaged).is_err_and(|error| error.to_string().contains("checksum")));
    }
}
