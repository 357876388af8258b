//! Enums whose variants have names, as options, files and tables write them.

/// Defines an enum by its variants and their names, such as `Csv = "csv"`. `ALL` has the variants in their order,
/// `name` returns the name of one, `of_name` the variant with a name; `Display` writes the name. With `or` and a
/// function that makes the error from the text, `FromStr` reads it.
///
/// `strum` would need four derives at each enum, an attribute instead of `= "csv"` at each of some hundred variants, and a
/// procedural macro to compile.
#[macro_export]
macro_rules! named {
    ($(#[$of_enum:meta])* $visibility:vis enum $enum:ident {
        $($(#[$of_variant:meta])* $variant:ident = $name:literal),+ $(,)?
    } $(or $error:expr)?) => {
        $(#[$of_enum])*
        $visibility enum $enum {
            $($(#[$of_variant])* $variant),+
        }

        impl std::fmt::Display for $enum {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl $enum {
            /// Returns the variant with this name.
            #[must_use]
            pub fn of_name(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.name() == name)
            }

            /// All variants, in their order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Returns the name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        $(impl std::str::FromStr for $enum {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                let error: fn(&str) -> String = $error;
                Self::of_name(name).ok_or_else(|| error(name))
            }
        })?
    };
}
