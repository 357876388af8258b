//! Display of the feet on a terminal.

use estimator_core::{Decision, Phase};
use feet::LiveFoot;
use feet::session::SEVERAL_BOARDS;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Sparkline};

use super::curve::Curve;
use super::robot::{MonitorEvent, MonitorState};

/// Minimum and maximum lines per foot: two lines of text, the rest for the curve.
const LINES: (u16, u16) = (4, 10);

/// Minimum lines of events.
const EVENT_LINES: u16 = 3;

/// Number of vertical steps of a curve.
const STEPS: u64 = 1000;

/// Update state of the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Running {
    /// The display follows the feet.
    Live,
    /// The display is frozen; reception continues.
    Paused,
}

/// Draws the whole display.
pub fn draw(frame: &mut Frame<'_>, robot: &MonitorState, source: &str, running: Running) {
    let all = robot.feet();
    let feet = u16::try_from(all.len()).unwrap_or(u16::MAX);
    let height = frame.area().height;
    let free = height.saturating_sub(2 + EVENT_LINES);
    let lines = (free / feet.max(1)).clamp(LINES.0, LINES.1);
    let shown = (free / lines).min(feet);
    let [head, body, events, foot] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(shown * lines),
        Constraint::Min(EVENT_LINES),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(headline(robot, source, running, feet - shown), head);
    let areas = Layout::vertical(vec![Constraint::Length(lines); usize::from(shown)]).split(body);
    for ((foot, curve), area) in all.into_iter().zip(areas.iter()) {
        draw_foot(frame, robot, foot, curve, *area);
    }
    frame.render_widget(event_lines(robot, events.height), events);
    let keys = "q quit   space pause   m mark   r record";
    frame.render_widget(Paragraph::new(keys).style(faint()), foot);
}

fn faint() -> Style {
    Style::new().add_modifier(Modifier::DIM)
}

fn headline(
    robot: &MonitorState,
    source: &str,
    running: Running,
    hidden: u16,
) -> Paragraph<'static> {
    let mut spans = vec![
        Span::styled("footfall ", Style::new().add_modifier(Modifier::BOLD)),
        Span::raw(format!("{source}   {:.1} s", robot.session().elapsed_s())),
    ];
    let warning = Style::new().fg(Color::Yellow);
    if running == Running::Paused {
        spans.push(Span::styled("   paused", warning));
    }
    if let Some(recording) = &robot.recording {
        let text = format!("   recording to {}", recording.path.display());
        spans.push(Span::styled(text, Style::new().fg(Color::Red)));
    }
    if hidden > 0 {
        let text = format!("   {hidden} more feet below");
        spans.push(Span::styled(text, warning));
    }
    if let Some(device) = &robot.waits_for {
        spans.push(Span::styled(format!("   waiting for {device}"), warning));
    } else if robot.has_ended() {
        spans.push(Span::styled("   ended", warning));
    } else if robot.session().feet().is_empty() {
        spans.push(Span::styled("   no foot heard yet", warning));
    }
    if robot.unreadable() > 0 {
        let text = format!("   {} pieces unreadable", robot.unreadable());
        spans.push(Span::styled(text, warning));
    }
    Paragraph::new(Line::from(spans))
}

fn draw_foot(
    frame: &mut Frame<'_>,
    robot: &MonitorState,
    foot: &LiveFoot,
    curve: &Curve,
    area: Rect,
) {
    let line = Constraint::Length(1);
    let [first, middle, second] = Layout::vertical([line, Constraint::Min(1), line]).areas(area);
    frame.render_widget(contact_line(robot, foot), first);
    let values = curve.least(usize::from(middle.width)).into_iter();
    let values: Vec<u64> = values.map(|p| (p * STEPS as f32) as u64).collect();
    let sparkline = Sparkline::default().data(values).max(STEPS);
    frame.render_widget(sparkline.style(Style::new().fg(colour(foot))), middle);
    frame.render_widget(health_line(foot), second);
}

/// Returns the colour of a foot: green in stance, yellow in a slip, red with a fault.
fn colour(foot: &LiveFoot) -> Color {
    match &foot.row {
        _ if foot.faults.void_estimate() => Color::Red,
        Some(row) if row.status.phase() == Phase::Slip => Color::Yellow,
        Some(row) if row.status.decision() == Decision::Stable => Color::Green,
        _ => Color::Blue,
    }
}

fn contact_line(robot: &MonitorState, foot: &LiveFoot) -> Paragraph<'static> {
    let name = format!("{:<5}", foot.name_or("node "));
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let mut spans = vec![Span::styled(name, bold)];
    let Some(row) = &foot.row else {
        spans.push(Span::raw("no contact yet"));
        return Paragraph::new(Line::from(spans));
    };
    if foot.second.is_of_several_boards(robot.session().now()) {
        spans.push(Span::styled(SEVERAL_BOARDS, Style::new().fg(Color::Red)));
        return Paragraph::new(Line::from(spans));
    }
    if foot.is_silent(robot.session().now()) || robot.waits_for.is_some() {
        spans.push(Span::styled("silent   last ", Style::new().fg(Color::Red)));
    }
    let decision = match row.status.decision() {
        Decision::Stable => "stable",
        _ => "not stable",
    };
    let (p, phase) = (row.stable, row.status.phase().name());
    let text = format!("P {p:.2}  {phase:<7}  {decision:<10}");
    spans.push(Span::styled(text, Style::new().fg(colour(foot))));
    spans.push(Span::raw(format!(
        "  tangential {:.2}  vertical {:.2}",
        row.tangential, row.vertical
    )));
    if let Some(load) = foot.load {
        spans.push(Span::raw(format!("  load {load:.0} N")));
    }
    Paragraph::new(Line::from(spans))
}

fn health_line(foot: &LiveFoot) -> Paragraph<'static> {
    let alarm = Style::new().fg(Color::Red);
    let faults = foot.faults.iter();
    let faults = faults.map(|fault| Span::styled(fault.name(), alarm));
    let mut words: Vec<_> = faults.collect();
    if let Some((_, Some(reason))) = foot.started {
        let text = format!("started after: {}", reason.name());
        words.push(Span::styled(text, alarm));
    }
    let flags = foot.row.as_ref().map(feet::decode::ContactRow::flag_names);
    for flag in flags.unwrap_or_default() {
        words.push(Span::styled(flag, Style::new().fg(Color::Yellow)));
    }
    if let Some(rate) = foot.second.rate_hz() {
        words.push(Span::raw(format!("{rate:.0} Hz")));
    }
    if let Some(jitter) = foot.second.jitter_ms() {
        words.push(Span::raw(format!("jitter {jitter:.1} ms")));
    }
    let lost = format!("missing {} dropped {}", foot.missing, foot.dropped);
    words.push(match foot.missing + foot.dropped {
        0 => Span::raw(lost),
        _ => Span::styled(lost, alarm),
    });
    if let Some([roll, pitch]) = foot.tilt_deg() {
        words.push(Span::raw(format!("tilt {roll:.0}° {pitch:.0}°")));
    }
    if let Some(celsius) = foot.temperature {
        words.push(Span::raw(format!("{celsius:.0} °C")));
    }
    if let Some(board) = &foot.board {
        words.push(Span::raw(board.stage.name()));
    }
    let mut spans = vec![Span::raw("   ")];
    let words = words.into_iter();
    spans.extend(words.flat_map(|word| [Span::raw("  "), word]));
    Paragraph::new(Line::from(spans))
}

fn event_lines(robot: &MonitorState, height: u16) -> Paragraph<'static> {
    let height = usize::from(height);
    let events = robot.events();
    let newest = events.iter().skip(events.len().saturating_sub(height));
    let line = |MonitorEvent { t, foot, text }: &MonitorEvent| {
        let foot = foot.as_deref().unwrap_or("");
        Line::from(format!("{t:9.1} s  {foot:<4} {text}"))
    };
    Paragraph::new(newest.map(line).collect::<Vec<_>>()).style(faint())
}

#[cfg(test)]
mod tests {
    use super::*;
    use feet::Feed;
    use feet::decode::Feet;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use std::time::Duration;

    fn shown(source: &str, width: u16, height: u16, running: Running) -> String {
        let feed = Feed::open(source.parse().expect("a source"));
        let mut robot = MonitorState::new(Feet::default());
        while !robot.has_ended() {
            robot.listen(&feed, feed.clock().now() + Duration::from_secs(600));
        }
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
        terminal
            .draw(|frame| draw(frame, &robot, source, running))
            .expect("drawn");
        terminal.backend().to_string()
    }

    #[test]
    fn four_feet_fit_small_and_large_terminals() {
        for (width, height) in [(80, 24), (200, 60)] {
            let screen = shown(
                "demo:feet=4,speed=max,seconds=4",
                width,
                height,
                Running::Live,
            );
            for foot in ["FL", "FR", "RL", "RR"] {
                let begins = format!("\"{foot}   P ");
                assert!(
                    screen.contains(&begins),
                    "{foot} at {width}x{height}:\n{screen}"
                );
            }
            for word in [
                "tangential",
                "1000 Hz",
                "missing 0 dropped 0",
                "load",
                "q quit",
                "ended",
            ] {
                assert!(
                    screen.contains(word),
                    "{word} at {width}x{height}:\n{screen}"
                );
            }
            assert!(
                screen.contains('█'),
                "a curve at {width}x{height}:\n{screen}"
            );
        }
    }

    #[test]
    fn hidden_feet_are_counted_at_any_terminal_size() {
        let source = "demo:feet=6,speed=max,seconds=1";
        let screen = shown(source, 80, 24, Running::Paused);
        assert!(screen.contains("2 more feet below"), "{screen}");
        assert!(screen.contains("paused"), "{screen}");
        for (width, height) in [(1, 1), (3, 5), (20, 3), (500, 6)] {
            shown(source, width, height, Running::Live);
        }
    }
}
