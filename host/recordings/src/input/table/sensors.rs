//! Choice among several sensors in one table.

use super::mapping::Mapping;
use super::names::{Found, Triple, find_with_units};

/// Complete mapping of each of several sensors, whose axes `triple` were found more than once in a header: with those of
/// the other kind whose names begin alike. A kind with our names in the header is left out.
pub(super) fn choices(triple: Triple, found: &[[usize; 3]], names: &[String]) -> Vec<Mapping> {
    let other = match triple {
        Triple::Acceleration => Triple::Rate,
        Triple::Rate => Triple::Acceleration,
    };
    let is_ours = |axis: &str| names.iter().any(|name| name == axis);
    let others = match find_with_units(other, names) {
        _ if other.ours().into_iter().any(is_ours) => Vec::new(),
        Found::Nowhere => Vec::new(),
        Found::At(only) => vec![only],
        Found::Several(several) => several,
    };
    let of_sensor = |axes: &[usize; 3]| {
        let [x, ..] = *axes;
        let alike = |[other, ..]: &&[usize; 3]| common_start(&names[x], &names[*other]);
        // First one of several that are equally alike.
        let with = others.iter().rev().max_by_key(alike);
        let ours = [triple.ours(), other.ours()].concat().into_iter();
        let theirs = axes.iter().chain(with.into_iter().flatten());
        let pairs = ours.zip(theirs.map(|index| names[*index].clone()));
        let mut columns: Vec<_> = pairs.collect();
        columns.sort_unstable();
        Mapping { columns }
    };
    found.iter().map(of_sensor).collect()
}

/// Options with mappings, for an error.
pub(in crate::input) fn options(mappings: &[Mapping]) -> String {
    let options = mappings.iter().map(|mapping| format!("--map {mapping}"));
    options.collect::<Vec<_>>().join(" or ")
}

/// Number of bytes with which both names begin.
fn common_start(a: &str, b: &str) -> usize {
    let both = a.bytes().zip(b.bytes());
    both.take_while(|(a, b)| a == b).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(header: &str) -> Vec<String> {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        let kinds = [Triple::Acceleration, Triple::Rate];
        let several = kinds.into_iter().find_map(|triple| match find_with_units(triple, &names) {
            Found::Several(found) => Some(choices(triple, &found, &names)),
            _ => None,
        });
        let mappings = several.expect("several sensors").into_iter();
        mappings.map(|mapping| mapping.to_string()).collect()
    }

    #[test]
    fn sensors_are_paired_by_the_beginning_of_their_names() {
        let header = "/r/gyro/x,/r/gyro/y,/r/gyro/z,/l/acc/x,/l/acc/y,/l/acc/z,\
                      /l/gyro/x,/l/gyro/y,/l/gyro/z,/r/acc/x,/r/acc/y,/r/acc/z";
        let of = |foot: char| {
            format!(
                "ax=/{foot}/acc/x,ay=/{foot}/acc/y,az=/{foot}/acc/z,\
                 wx=/{foot}/gyro/x,wy=/{foot}/gyro/y,wz=/{foot}/gyro/z"
            )
        };
        assert_eq!(chosen(header), [of('l'), of('r')]);
    }

    #[test]
    fn only_sensor_of_the_other_kind_is_in_each_choice() {
        let header = "acc_x,acc_y,acc_z,l_gyro_x,l_gyro_y,l_gyro_z,r_gyro_x,r_gyro_y,r_gyro_z";
        let chosen = chosen(header);
        assert_eq!(chosen.len(), 2);
        assert!(chosen.iter().all(|choice| choice.starts_with("ax=acc_x,")));
        assert!(chosen[1].ends_with(",wx=r_gyro_x,wy=r_gyro_y,wz=r_gyro_z"));
        let ours = "ax,ay,az,l_gyro_x,l_gyro_y,l_gyro_z,r_gyro_x,r_gyro_y,r_gyro_z";
        assert_eq!(self::chosen(ours)[0], "wx=l_gyro_x,wy=l_gyro_y,wz=l_gyro_z");
    }
}
