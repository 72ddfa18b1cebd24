// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <tiny_gltf.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/products/textured_mesh_file.h"
#include "products/jpeg.h"

namespace mono3d {
namespace {

// A glTF model as it grows: one buffer, each list a view of it.
class GltfBuilder {
 public:
  explicit GltfBuilder(std::size_t num_bytes) {
    model_.buffers.resize(1);
    model_.buffers[0].data.reserve(num_bytes);
    model_.asset.version = "2.0";
    model_.asset.generator = "mono3d";
  }

  tinygltf::Model& model() { return model_; }

  // `target`: what the view holds, vertices or corners; 0 of an image.
  int AddView(const void* bytes, std::size_t num_bytes, int target) {
    std::vector<unsigned char>& data = model_.buffers[0].data;
    data.resize((data.size() + 3) / 4 * 4);  // numbers lie at multiples of their size
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = num_bytes;
    view.target = target;
    const auto* first = static_cast<const unsigned char*>(bytes);
    data.insert(data.end(), first, first + num_bytes);
    model_.bufferViews.push_back(std::move(view));
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  template <typename Vector>
  int AddVertices(const std::vector<Vector>& vectors, int type) {
    return AddAccessor(
        AddView(vectors.data(), vectors.size() * sizeof(Vector), TINYGLTF_TARGET_ARRAY_BUFFER),
        vectors.size(), TINYGLTF_COMPONENT_TYPE_FLOAT, type);
  }

  int AddCorners(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
    return AddAccessor(AddView(triangles.data(), triangles.size() * sizeof(triangles[0]),
                               TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                       3 * triangles.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                       TINYGLTF_TYPE_SCALAR);
  }

  // A material that shows the image as it is.
  int AddMaterial(const std::vector<unsigned char>& jpeg) {
    tinygltf::Image image;
    image.bufferView = AddView(jpeg.data(), jpeg.size(), 0);
    image.mimeType = "image/jpeg";
    model_.images.push_back(std::move(image));
    tinygltf::Texture texture;
    texture.source = static_cast<int>(model_.images.size()) - 1;
    texture.sampler = 0;
    model_.textures.push_back(std::move(texture));
    tinygltf::Material material;
    material.pbrMetallicRoughness.baseColorTexture.index =
        static_cast<int>(model_.textures.size()) - 1;
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.pbrMetallicRoughness.roughnessFactor = 1;
    material.doubleSided = true;
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    model_.materials.push_back(std::move(material));
    return static_cast<int>(model_.materials.size()) - 1;
  }

 private:
  int AddAccessor(int view, std::size_t count, int component, int type) {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.count = count;
    accessor.componentType = component;
    accessor.type = type;
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Model model_;
};

tinygltf::Value ExtrasOf(const MeshFileOptions& options) {
  tinygltf::Value::Object extras;
  if (options.origin) {
    extras["axes"] = tinygltf::Value(std::string("x east, y north, z up before the node's turn"));
    extras["unit"] = tinygltf::Value(std::string("metre"));
    extras["origin_latitude_deg"] = tinygltf::Value(options.origin->latitude_deg);
    extras["origin_longitude_deg"] = tinygltf::Value(options.origin->longitude_deg);
    extras["origin_altitude_m"] = tinygltf::Value(options.origin->altitude_m);
    extras["ellipsoid"] = tinygltf::Value(std::string("WGS 84"));
  } else {
    extras["axes"] = tinygltf::Value(std::string("z up before the node's turn"));
    extras["unit"] = tinygltf::Value(std::string("the run's own, without a scale"));
  }
  return tinygltf::Value(extras);
}

void AddBounds(const std::vector<Eigen::Vector3f>& vertices, tinygltf::Accessor& accessor) {
  Eigen::Vector3f lowest = vertices[0];
  Eigen::Vector3f highest = vertices[0];
  for (const Eigen::Vector3f& vertex : vertices) {
    lowest = lowest.cwiseMin(vertex);
    highest = highest.cwiseMax(vertex);
  }
  for (int axis = 0; axis < 3; ++axis) {
    accessor.minValues.push_back(lowest[axis]);
    accessor.maxValues.push_back(highest[axis]);
  }
}

}  // namespace

void Validate(const TexturedMesh& mesh, const std::string& where) {
  const auto refuse = [&](const std::string& expected, const std::string& found) {
    throw Error(ErrorParts{"not a mesh with textures", where, expected, found});
  };
  const std::size_t count = mesh.vertices.size();
  if (count == 0) refuse("some vertices", "none");
  if (mesh.normals.size() != count || mesh.texture_coordinates.size() != count) {
    refuse("a normal and a place in the texture for each vertex", "fewer or more");
  }
  if (mesh.textures.size() != mesh.triangles.size()) refuse("a texture for each part", "not");
  for (const auto& part : mesh.triangles) {
    for (const auto& triangle : part) {
      if (std::ranges::max(triangle) >= count) refuse("corners that are there", "others");
    }
  }
}

void WriteGlb(const std::filesystem::path& file, const TexturedMesh& mesh,
              const MeshFileOptions& options) {
  Validate(mesh, file.string());
  std::vector<std::vector<unsigned char>> textures;
  std::size_t num_bytes = mesh.vertices.size() * 8 * sizeof(float) + 4096;
  for (std::size_t i = 0; i < mesh.textures.size(); ++i) {
    textures.push_back(JpegOf(mesh.textures[i], options.jpeg_quality));
    num_bytes += textures.back().size() + mesh.triangles[i].size() * 3 * sizeof(std::uint32_t) + 8;
  }
  if (num_bytes > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorParts{
        "a glTF file cannot be that large: take fewer triangles or textures", file.string(),
        "4 GB at most", std::to_string(num_bytes / 1000000000) + " GB", ErrorCode::kUnsupported});
  }
  GltfBuilder builder(num_bytes);
  tinygltf::Model& model = builder.model();
  model.asset.extras = ExtrasOf(options);
  model.extensionsUsed = {"KHR_materials_unlit"};
  tinygltf::Sampler sampler;
  sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
  sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
  model.samplers.push_back(std::move(sampler));

  const int positions = builder.AddVertices(mesh.vertices, TINYGLTF_TYPE_VEC3);
  AddBounds(mesh.vertices, model.accessors.back());
  const int normals = builder.AddVertices(mesh.normals, TINYGLTF_TYPE_VEC3);
  const int coordinates = builder.AddVertices(mesh.texture_coordinates, TINYGLTF_TYPE_VEC2);
  tinygltf::Mesh parts;
  for (std::size_t i = 0; i < textures.size(); ++i) {
    if (mesh.triangles[i].empty()) continue;
    tinygltf::Primitive part;
    part.attributes = {{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_0", coordinates}};
    part.indices = builder.AddCorners(mesh.triangles[i]);
    part.material = builder.AddMaterial(textures[i]);
    part.mode = TINYGLTF_MODE_TRIANGLES;
    parts.primitives.push_back(std::move(part));
  }
  model.meshes.push_back(std::move(parts));
  tinygltf::Node node;
  node.name = "model";
  node.mesh = 0;
  // Column by column: x stays, y goes to -z, z to y.
  node.matrix = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  model.nodes.push_back(std::move(node));
  tinygltf::Scene scene;
  scene.nodes = {0};
  model.scenes.push_back(std::move(scene));
  model.defaultScene = 0;

  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model, stream, /*prettyPrint=*/false, /*writeBinary=*/true)) {
    throw Error(ErrorParts{"cannot write the mesh as glTF", file.string(), {}, {}, ErrorCode::kIo});
  }
  WriteFileAtomically(file, stream.str());
}

}  // namespace mono3d
