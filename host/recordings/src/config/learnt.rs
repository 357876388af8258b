//! Keys of the learnt values of a foot: a warm start.

use estimator_core::Learnt;
use estimator_core::stillness::Classes;
use serde::{Deserialize, Serialize};

/// Defines a table of keys with the fields of a type of the estimator, and both conversions.
macro_rules! keys_of {
    ($of:ident: $(#[$doc:meta])* pub struct $name:ident {
        $($(#[$of_field:meta])* pub $field:ident: $type:ty,)+
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$of_field])* pub $field: $type,)+
        }

        impl From<$of> for $name {
            fn from(of: $of) -> Self {
                let $of { $($field),+ } = of;
                Self { $($field: $field.into()),+ }
            }
        }

        impl From<$name> for $of {
            fn from(keys: $name) -> Self {
                Self { $($field: keys.$field.into()),+ }
            }
        }
    };
}

keys_of! {
    Learnt:
    /// Values of a foot's [`Learnt`]. Numbers read back as the same f32.
    pub struct LearntValues {
        /// Stillness that was learnt from, s.
        pub still_seconds: f32,
        /// Motion that was learnt from, s.
        pub moving_seconds: f32,
        /// How long the foot has run since it last learnt anything, s.
        pub idle_seconds: f32,
        /// Acceleration without gravity.
        pub acceleration: ClassesValues,
        /// Angular rate.
        pub rate: ClassesValues,
        /// Leaky mean of the acceleration.
        pub velocity: ClassesValues,
    }
}

keys_of! {
    Classes:
    /// [`Classes`] of one quantity: natural logarithms of amplitudes in m/s² or rad/s.
    pub struct ClassesValues {
        /// Mean in stillness.
        pub still: f32,
        /// Mean in motion.
        pub moving: f32,
        /// Mean deviation in stillness.
        pub width: f32,
    }
}
