//! A tree of configurations with the domain in which each is extended.

use super::space::JointSpace;

/// A tree that grows from one or several roots.
pub(super) struct Tree {
    joints: usize,
    /// Joint values, node after node.
    values: Vec<f64>,
    parents: Vec<Option<u32>>,
    /// Distance up to which samples extend a node [rad].
    radii: Vec<f64>,
}

impl Tree {
    pub fn new(joints: usize, roots: &[&[f64]]) -> Self {
        let mut tree = Self { joints, values: Vec::new(), parents: Vec::new(), radii: Vec::new() };
        roots.iter().for_each(|root| _ = tree.add(root, None));
        tree
    }

    pub fn len(&self) -> usize {
        self.parents.len()
    }

    pub fn node(&self, index: usize) -> &[f64] {
        &self.values[index * self.joints..(index + 1) * self.joints]
    }

    /// Adds a node; its index.
    pub fn add(&mut self, q: &[f64], parent: Option<usize>) -> usize {
        self.values.extend_from_slice(q);
        self.parents.push(parent.map(|parent| parent as u32));
        self.radii.push(f64::INFINITY);
        self.len() - 1
    }

    /// The node nearest to a configuration, the first of several, and its distance [rad].
    pub fn nearest(&self, space: &JointSpace, q: &[f64]) -> (usize, f64) {
        let mut best = (0, f64::INFINITY);
        for (index, node) in self.values.chunks_exact(self.joints).enumerate() {
            let squared = space.squared_distance(node, q, best.1);
            if squared < best.1 {
                best = (index, squared);
            }
        }
        (best.0, best.1.sqrt())
    }

    pub fn radius(&self, node: usize) -> f64 {
        self.radii[node]
    }

    pub fn set_radius(&mut self, node: usize, radius: f64) {
        self.radii[node] = radius;
    }

    /// Index of the root from which a node grew.
    pub fn root(&self, mut node: usize) -> usize {
        while let Some(parent) = self.parents[node] {
            node = parent as usize;
        }
        node
    }

    /// From a node to its root.
    pub fn way_to_root(&self, node: usize) -> Vec<Vec<f64>> {
        let mut way = vec![self.node(node).to_vec()];
        let mut next = self.parents[node];
        while let Some(node) = next {
            way.push(self.node(node as usize).to_vec());
            next = self.parents[node as usize];
        }
        way
    }
}
