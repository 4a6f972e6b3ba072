mod disk;
mod measure;
mod picture;
