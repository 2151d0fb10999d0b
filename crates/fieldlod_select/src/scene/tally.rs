//! Sums of numbers over instances within planes, for statistics of what another path culls.

use glam::Vec4;

use super::{InstanceId, Scene};

/// What is counted of instances: sums over those that have been given numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Sums of the [numbers](Scene::set_numbers) of instances.
    pub sums: [u64; 3],
    /// How many instances have none.
    pub without_numbers: u32,
}

impl Scene {
    /// Gives an instance numbers that [`Scene::tally_within`] adds up, or takes them off; to begin with it has
    /// none. That changes nothing that is selected. Nothing if it was removed.
    pub fn set_numbers(&mut self, instance: InstanceId, numbers: Option<[u32; 3]>) {
        if self.mesh_of(instance).is_some() {
            self.instances[instance.index()].numbers = numbers;
        }
    }

    /// The tally of instances on one of `layers` that have numbers and are certainly on the inner side of all
    /// `planes`, each a normal of length 1 and a distance along it, as those of a frustum are. Visits every other
    /// instance on those layers that may have something there; with it, whether all of it certainly is. With `sums`
    /// off it visits all of them; with it on, instances on none of the layers must have no numbers, or zeros.
    pub fn tally_within(
        &self,
        planes: &[Vec4],
        layers: u64,
        sums: bool,
        visit: &mut impl FnMut(InstanceId, bool),
    ) -> Tally {
        let mut tally = Tally::default();
        for (index, entry) in (0..).zip(&self.entries) {
            if entry.seen_mesh(layers).is_none() {
                continue;
            }
            let instance = &self.instances[index as usize];
            let center = instance.sphere.center.extend(1.0);
            let inside_by = planes.iter().map(|plane| plane.dot(center));
            let least = inside_by.fold(f32::INFINITY, f32::min);
            if least < -instance.sphere.radius {
                continue;
            }
            let is_within = least > instance.sphere.radius;
            match instance.numbers {
                Some(numbers) if is_within && sums => {
                    for (sum, number) in tally.sums.iter_mut().zip(numbers) {
                        *sum += u64::from(number);
                    }
                }
                _ => visit(self.instance_at(index), is_within),
            }
        }
        tally
    }
}
