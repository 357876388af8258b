//! The estimator as one file of C, for processors and compilers for which the Rust compiler makes no library.
//!
//! The Rust compiler makes WebAssembly of `estimator-c`, and `wasm2c` of WABT makes C of it. That C would need a runtime
//! and a memory of 64 KiB. So only its functions are taken, between two files of `estimator-c/generic`:
//!
//! | part | content |
//! |---|---|
//! | `operations.c` | instructions of WebAssembly, as far as the estimator has them |
//! | generated | sizes, constants, functions |
//! | `functions.c` | functions of the header, each with a memory on the stack of its call |

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use anyhow::{Context, Result, bail};

use crate::command::{Step, is_installed, root};
use crate::firmware;

/// Target of the Rust compiler.
const TARGET: &str = "wasm32-unknown-unknown";

/// Stack of the machine, bytes: addresses from 0 on. A call must not need more.
const STACK_SIZE: usize = 2048;

/// Address of the constants, behind the memory of a call.
const CONSTANTS: usize = 0x4000;

/// Bytes of the objects that the longest call has in the memory: sample, estimate and load.
const OBJECTS_SIZE: usize = 160;

/// Beginning of each function of `wasm2c`.
const INSTANCE: &str = "(Z_footfall_instance_t*";

/// Returns the file.
///
/// # Errors
/// A tool is missing, the build fails, or the WebAssembly has what the file cannot have: a call from outside, a table,
/// variables, or a deeper stack.
pub fn source() -> Result<String> {
    if !is_installed("wasm2c") {
        bail!("wasm2c is not installed (Debian: apt-get install wabt)");
    }
    Step::program("rustup").with(["target", "add", TARGET]).run()?;
    let folders = firmware::folders()?;
    let mut flags: Vec<String> = folders
        .iter()
        .map(|(folder, name)| format!("--remap-path-prefix={}={name}", folder.display()))
        .collect();
    flags.extend([
        format!("-Clink-arg=-zstack-size={STACK_SIZE}"),
        format!("-Clink-arg=--global-base={CONSTANTS}"),
        "-Cstrip=symbols".to_owned(),
    ]);
    Step::cargo(&["rustc", "--locked", "--profile", "firmware", "--lib", "--target", TARGET])
        .with(["--package", "estimator-c", "--crate-type", "cdylib", "--features", "alone"])
        .with(["--config", "profile.firmware.panic='abort'"])
        .with(["--config", "profile.firmware.package.footfall-estimator.opt-level='s'"])
        .with(["--config", "profile.firmware.debug=0"])
        .with(["--config", &format!("target.{TARGET}.rustflags={flags:?}")])
        .run()?;
    let built = root().join("target").join(TARGET).join("firmware");
    let translated = built.join("footfall.c");
    Step::program("wasm2c")
        .with(["-n", "footfall", &built.join("estimator_c.wasm").display().to_string()])
        .with(["-o", &translated.display().to_string()])
        .run()?;
    let text = fs::read_to_string(&translated).context("the output of wasm2c")?;
    let machine = Machine::of(&text)?;
    let part = |name: &str| {
        let path = root().join("estimator-c/generic").join(name);
        fs::read_to_string(&path).with_context(|| path.display().to_string())
    };
    let operations = part("operations.c")?.replace("@CONSTANTS@", &machine.constants_text());
    Ok(operations + &machine.text()? + &part("functions.c")?)
}

/// Parts of the output of `wasm2c`.
#[derive(Debug, Default)]
struct Machine {
    /// Bytes of constants.
    constants: Vec<u8>,
    /// Functions by their names, in the order of the output.
    functions: Vec<(String, String)>,
}

impl Machine {
    fn of(text: &str) -> Result<Self> {
        let mut machine = Self::default();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            if let Some((_, behind)) = line.split_once("instance->w2c_g0 = ")
                && behind != format!("{STACK_SIZE}u;")
            {
                bail!("the stack begins at {behind}");
            }
            if line.starts_with("static const u8 data_segment_data_") {
                if !machine.constants.is_empty() {
                    bail!("a second part of constants: there are variables");
                }
                let rows = lines.by_ref().take_while(|line| *line != "};");
                for byte in rows.flat_map(|row| row.split(", ")).map(str::trim) {
                    let byte = byte.trim_end_matches(',');
                    if let Some(digits) = byte.strip_prefix("0x") {
                        machine.constants.push(u8::from_str_radix(digits, 16)?);
                    }
                }
            }
            if line.contains("LOAD_DATA(instance->") && !line.contains(&format!(" {CONSTANTS}u,")) {
                bail!("the constants have another address: {line}");
            }
            if line.contains("/* import: ") || line.contains("funcref_table_init(&") {
                bail!("a call from outside, or by a pointer: {line}");
            }
            let is_function = line.starts_with("static ") && line.contains(INSTANCE);
            let name = line.split(' ').find_map(|word| word.strip_prefix("w2c_"));
            if let (true, Some(name)) = (is_function, name) {
                let name = name.split('(').next().unwrap_or_default();
                let mut function = format!("{line}\n");
                let end = if line.contains(" instance") { "}" } else { ");" };
                // A declaration needs no body. Both may have several lines of parameters.
                if !line.ends_with(end) {
                    for line in lines.by_ref() {
                        let _ = writeln!(function, "{line}");
                        if line == "}" || (end == ");" && line.ends_with(end)) {
                            break;
                        }
                    }
                }
                machine.functions.push((name.to_owned(), function));
            }
        }
        Ok(machine)
    }

    /// The generated part of the file.
    fn text(&self) -> Result<String> {
        let stack = self.deepest_stack()?;
        if stack > STACK_SIZE {
            bail!("a call takes {stack} bytes of the machine's stack, more than {STACK_SIZE}");
        }
        let size = self.estimator_size()?;
        let memory = STACK_SIZE + size + OBJECTS_SIZE;
        if memory > CONSTANTS {
            bail!("the memory of a call has {memory} bytes, more than {CONSTANTS}");
        }
        let mut text = format!(
            "enum {{\n    STACK_SIZE = {STACK_SIZE},\n    ESTIMATOR = STACK_SIZE,\n    ESTIMATOR_SIZE = {size},\n    \
             MEMORY_SIZE = {memory}\n}};\n\n"
        );
        text += "/* Memory of a call: stack, estimator, objects. */\ntypedef struct {\n    u32 w2c_g0;\n    union {\n        \
                 u64 words;\n        u8 bytes[MEMORY_SIZE];\n    } memory;\n} Machine;\n\n";
        for (_, function) in &self.functions {
            let function = function.replace("Z_footfall_instance_t", "Machine");
            text += &function.replace("instance->w2c_memory", "instance->memory");
        }
        Ok(text)
    }

    /// The constants in C, with their address.
    fn constants_text(&self) -> String {
        let mut constants = format!(
            "enum {{ CONSTANTS = {CONSTANTS} }};\n\nstatic const u8 constants[{}] = {{",
            self.constants.len()
        );
        for (place, byte) in self.constants.iter().enumerate() {
            constants += if place % 20 == 0 { "\n    " } else { " " };
            let _ = write!(constants, "{byte},");
        }
        constants + "\n};\n"
    }

    /// Bodies of the functions, by their names.
    fn bodies(&self) -> BTreeMap<&str, &str> {
        let bodies = self.functions.iter().filter(|(_, text)| text.contains('{'));
        bodies.map(|(name, text)| (name.as_str(), text.as_str())).collect()
    }

    /// Size of an estimator, which a function returns.
    fn estimator_size(&self) -> Result<usize> {
        let bodies = self.bodies();
        let body = bodies.get("footfall_estimator_size").context("no size of an estimator")?;
        let mut values = body.lines().filter_map(|line| line.trim().strip_prefix("w2c_i0 = "));
        let value = values.next_back().and_then(|value| value.strip_suffix("u;"));
        Ok(value.context("the size of an estimator is not a constant")?.parse()?)
    }

    /// Stack of the deepest call, bytes.
    fn deepest_stack(&self) -> Result<usize> {
        let bodies = self.bodies();
        let mut known = BTreeMap::new();
        let mut deepest = 0;
        for name in bodies.keys() {
            deepest = deepest.max(stack_of(name, &bodies, &mut known, 0)?);
        }
        Ok(deepest)
    }
}

/// Stack of a function with its calls, bytes.
fn stack_of<'a>(
    name: &'a str,
    bodies: &BTreeMap<&'a str, &'a str>,
    known: &mut BTreeMap<&'a str, usize>,
    depth: usize,
) -> Result<usize> {
    if let Some(stack) = known.get(name) {
        return Ok(*stack);
    }
    if depth > bodies.len() {
        bail!("{name} calls itself");
    }
    let body = bodies.get(name).copied().with_context(|| format!("{name} has no body"))?;
    let mut deepest = 0;
    for called in body.split("w2c_").skip(1).filter_map(|rest| rest.split_once("(instance")) {
        if let Some((called, _)) = bodies.get_key_value(called.0) {
            deepest = deepest.max(stack_of(called, bodies, known, depth + 1)?);
        }
    }
    let stack = frame_of(body)? + deepest;
    known.insert(name, stack);
    Ok(stack)
}

/// Returns the number of bytes that a function takes from the stack. It loads the stack pointer and subtracts a constant,
/// at once or from a copy.
fn frame_of(body: &str) -> Result<usize> {
    let lines: Vec<&str> = body.lines().map(str::trim).collect();
    let Some(load) = lines.iter().position(|line| line.ends_with(" = instance->w2c_g0;")) else {
        return Ok(0);
    };
    let copy = lines[load + 1..].first().and_then(|line| line.strip_suffix(" = w2c_i0;"));
    let subtraction = lines[load..].windows(3).find_map(|three| {
        let [pointer, constant, subtraction] = three else { return None };
        let is_pointer = pointer.ends_with(" = instance->w2c_g0;")
            || copy.is_some_and(|copy| pointer.ends_with(&format!(" = {copy};")));
        let (_, constant) = constant.split_once(" = ")?;
        let is_subtracted = is_pointer && subtraction.contains(" -= ");
        constant.strip_suffix("u;").filter(|_| is_subtracted)
    });
    let name = lines.first().copied().unwrap_or_default();
    Ok(subtraction.with_context(|| format!("a frame without a constant size: {name}"))?.parse()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Output of `wasm2c` 1.0.32, shortened.
    const OUTPUT: &str = "static u32 w2c_f0(Z_footfall_instance_t*, u32);
static u32 w2c_footfall_estimator_size(Z_footfall_instance_t*);

static void init_globals(Z_footfall_instance_t* instance) {
  instance->w2c_g0 = 2048u;
}

static const u8 data_segment_data_w2c_d0[] = {
  0x61, 0x62, 
  0x00, 
};

static void init_memories(Z_footfall_instance_t* instance) {
  LOAD_DATA(instance->w2c_memory, 16384u, data_segment_data_w2c_d0, 3);
}

static u32 w2c_f0(Z_footfall_instance_t* instance, u32 w2c_p0) {
  u32 w2c_i0, w2c_i1;
  w2c_i0 = instance->w2c_g0;
  w2c_i1 = 16u;
  w2c_i0 -= w2c_i1;
  instance->w2c_g0 = w2c_i0;
  w2c_i0 = i32_load(&instance->w2c_memory, (u64)(w2c_p0));
  w2c_i0 = w2c_f1(instance, w2c_i0);
  return w2c_i0;
}

static u32 w2c_f1(Z_footfall_instance_t* instance, u32 w2c_p0) {
  u32 w2c_i0, w2c_i1, w2c_l2;
  w2c_i0 = instance->w2c_g0;
  w2c_l2 = w2c_i0;
  w2c_i0 = w2c_p0;
  w2c_i1 = 8u;
  w2c_i0 -= w2c_i1;
  w2c_i0 = w2c_l2;
  w2c_i1 = 40u;
  w2c_i0 -= w2c_i1;
  return w2c_i0;
}

static u32 w2c_footfall_estimator_size(Z_footfall_instance_t* instance) {
  u32 w2c_i0;
  w2c_i0 = 1136u;
  return w2c_i0;
}
";

    #[test]
    fn output_of_wasm2c_is_taken_apart() {
        let machine = Machine::of(OUTPUT).expect("all parts");
        assert_eq!(machine.constants, *b"ab\0");
        assert!(machine.constants_text().ends_with("constants[3] = {\n    97, 98, 0,\n};\n"));
        let names: Vec<&str> = machine.functions.iter().map(|(name, _)| name.as_str()).collect();
        let size = "footfall_estimator_size";
        assert_eq!(names, ["f0", size, "f0", "f1", size]);
        assert_eq!(machine.estimator_size().expect("a size"), 1136);
        assert_eq!(machine.deepest_stack().expect("a stack"), 56);
        let text = machine.text().expect("it fits");
        assert!(text.contains("MEMORY_SIZE = 3344\n"), "{text}");
        assert!(text.contains("i32_load(&instance->memory, "), "{text}");
        assert!(!text.contains("footfall_instance_t"), "{text}");
    }

    #[test]
    fn deeper_stack_and_calls_from_outside_are_refused() {
        let refused = |text: String| {
            Machine::of(&text).and_then(|machine| machine.text()).expect_err("refused").to_string()
        };
        let deep = refused(OUTPUT.replace("= 40u", "= 2040u"));
        assert!(deep.contains("takes 2056 bytes"), "{deep}");
        let import = refused(format!("/* import: 'env' 'f' */\n{OUTPUT}"));
        assert!(import.contains("call from outside"), "{import}");
        let endless = refused(OUTPUT.replace("w2c_f1(instance", "w2c_f0(instance"));
        assert!(endless.contains("calls itself"), "{endless}");
    }
}
