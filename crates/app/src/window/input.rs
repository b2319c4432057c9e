//! Mouse and keyboard.

use glam::Vec2;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{Key, NamedKey};

/// An action of the user.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum UserAction {
    Throw(Vec2),
    Turn(Vec2),
    Zoom(f32),
    Pause,
    Step,
    Slow,
    Panel,
    Help,
    Screenshot,
    Close,
    /// A key for the view.
    Key(String),
}

/// State of the mouse.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mouse {
    at: Vec2,
    turns: bool,
}

/// Pixels of a touchpad per notch of a wheel.
const NOTCH: f32 = 50.0;

impl Mouse {
    /// The action of an event.
    pub(super) fn action(&mut self, event: &WindowEvent) -> Option<UserAction> {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let at = Vec2::new(position.x as f32, position.y as f32);
                let moved = at - std::mem::replace(&mut self.at, at);
                self.turns.then_some(UserAction::Turn(moved))
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let pressed = *state == ElementState::Pressed;
                match button {
                    MouseButton::Left => pressed.then_some(UserAction::Throw(self.at)),
                    MouseButton::Right => {
                        self.turns = pressed;
                        None
                    }
                    _ => None,
                }
            }
            WindowEvent::MouseWheel { delta, .. } => Some(UserAction::Zoom(match delta {
                MouseScrollDelta::LineDelta(_, lines) => *lines,
                MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / NOTCH,
            })),
            WindowEvent::KeyboardInput { event, .. } => key(event),
            _ => None,
        }
    }

    /// The mouse is over a panel or has left the window.
    pub(super) fn let_go(&mut self) {
        self.turns = false;
    }
}

/// The key that an event presses or releases, for views that hold keys, and whether it is down.
pub(super) fn held(event: &WindowEvent) -> Option<(String, bool)> {
    let WindowEvent::KeyboardInput { event, .. } = event else {
        return None;
    };
    let key = match &event.logical_key {
        Key::Named(NamedKey::Space) => "space".to_owned(),
        Key::Named(NamedKey::Shift) => "shift".to_owned(),
        Key::Character(text) => text.to_lowercase(),
        _ => return None,
    };
    Some((key, event.state == ElementState::Pressed))
}

fn key(event: &KeyEvent) -> Option<UserAction> {
    if event.state != ElementState::Pressed {
        return None;
    }
    let action = match &event.logical_key {
        Key::Named(NamedKey::Space) => UserAction::Pause,
        Key::Named(NamedKey::F12) => UserAction::Screenshot,
        Key::Named(NamedKey::Escape) => UserAction::Close,
        Key::Character(text) => match text.to_lowercase().as_str() {
            "." => UserAction::Step,
            "s" => UserAction::Slow,
            "p" => UserAction::Panel,
            "h" => UserAction::Help,
            other => UserAction::Key(other.to_owned()),
        },
        _ => return None,
    };
    // A key that is held down repeats; only single steps use that.
    (!event.repeat || action == UserAction::Step).then_some(action)
}
