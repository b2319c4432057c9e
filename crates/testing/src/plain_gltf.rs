//! glTF read naively, as an oracle: matrices multiplied down the tree, floats and straight lines between keys only.

use glam::{DMat4, DQuat, DVec3, DVec4};
use serde_json::Value;

pub struct PlainGltf {
    json: Value,
    binary: Vec<u8>,
}

impl PlainGltf {
    pub fn parse(glb: &[u8]) -> Self {
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        Self {
            json: serde_json::from_slice(&glb[20..20 + length]).unwrap(),
            binary: glb[28 + length..].to_vec(),
        }
    }

    fn floats(&self, accessor: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        assert_eq!(accessor["componentType"], 5126);
        let width = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => panic!("{other}"),
        };
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let offset = |value: &Value| value["byteOffset"].as_u64().unwrap_or(0) as usize;
        let start = offset(view) + offset(accessor);
        let stride = view["byteStride"]
            .as_u64()
            .map_or(4 * width, |stride| stride as usize);
        let float = |at: usize| {
            f64::from(f32::from_le_bytes(
                self.binary[at..at + 4].try_into().unwrap(),
            ))
        };
        (0..accessor["count"].as_u64().unwrap() as usize)
            .map(|element| {
                let first = start + element * stride;
                (0..width).map(|part| float(first + 4 * part)).collect()
            })
            .collect()
    }

    /// A node's matrix in the space of the file.
    pub fn world(&self, animation: usize, node: usize, time: f64) -> DMat4 {
        let nodes = self.json["nodes"].as_array().unwrap();
        let parent = nodes.iter().position(|other| {
            let children = other["children"].as_array();
            children.is_some_and(|c| c.iter().any(|c| c.as_u64() == Some(node as u64)))
        });
        let local = self.local(animation, node, time);
        match parent {
            Some(parent) => self.world(animation, parent, time) * local,
            None => local,
        }
    }

    fn local(&self, animation: usize, node: usize, time: f64) -> DMat4 {
        let of = &self.json["nodes"][node];
        let numbers = |value: &Value| -> Option<Vec<f64>> {
            Some(
                value
                    .as_array()?
                    .iter()
                    .map(|n| n.as_f64().unwrap())
                    .collect(),
            )
        };
        if let Some(matrix) = numbers(&of["matrix"]) {
            return DMat4::from_cols_slice(&matrix);
        }
        let animation = &self.json["animations"][animation];
        let at = |path: &str, rest: &[f64]| -> Vec<f64> {
            let channels = animation["channels"].as_array().unwrap();
            let channel = channels.iter().find(|channel| {
                channel["target"]["path"] == path && channel["target"]["node"] == node
            });
            let Some(channel) = channel else {
                return numbers(&of[path]).unwrap_or_else(|| rest.to_vec());
            };
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let times = self.floats(&sampler["input"]);
            let values = self.floats(&sampler["output"]);
            let Some(after) = times.iter().position(|key| key[0] > time) else {
                return values.last().unwrap().clone();
            };
            if after == 0 {
                return values[0].clone();
            }
            let (start, end) = (times[after - 1][0], times[after][0]);
            let share = (time - start) / (end - start);
            let (a, b) = (&values[after - 1], &values[after]);
            if path == "rotation" {
                let a = DQuat::from_slice(a).normalize();
                let b = DQuat::from_slice(b).normalize();
                return a.slerp(b, share).to_array().to_vec();
            }
            a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect()
        };
        DMat4::from_scale_rotation_translation(
            DVec3::from_slice(&at("scale", &[1.0; 3])),
            DQuat::from_vec4(DVec4::from_slice(&at("rotation", &[0.0, 0.0, 0.0, 1.0]))).normalize(),
            DVec3::from_slice(&at("translation", &[0.0; 3])),
        )
    }
}
